//! Large arrays on large pages.
//!
//! A ray through a tree of many megabytes touches memory all over it, and with pages of 4 KiB nearly every
//! touch needs a walk through the page tables, which a virtual machine walks twice. Linux gives pages
//! of 2 MiB to memory for which a program asks for them (`transparent_hugepage`, see madvise(2)).

#![cfg_attr(
    target_os = "linux",
    expect(unsafe_code, reason = "a system call that takes an address")
)]

/// An empty vector with room for `capacity` elements, on large pages where the system has them.
///
/// It is advice: where it cannot be followed, nothing else changes.
pub(super) fn vec_on_large_pages<T>(capacity: usize) -> Vec<T> {
    let vec = Vec::<T>::with_capacity(capacity);
    #[cfg(target_os = "linux")]
    {
        use rustix::mm::{Advice, madvise};
        let page = rustix::param::page_size();
        let begin = vec.as_ptr().addr().next_multiple_of(page);
        let end = (vec.as_ptr().addr() + capacity * size_of::<T>()) / page * page;
        if begin < end {
            let address = vec.as_ptr().with_addr(begin).cast_mut().cast::<core::ffi::c_void>();
            // SAFETY: the range lies in the vector, and this advice changes no content.
            let _ = unsafe { madvise(address, end - begin, Advice::LinuxHugepage) };
        }
    }
    vec
}

/// A vector of so many equal elements, on large pages where the system has them.
pub(super) fn filled_on_large_pages<T: Clone>(len: usize, value: T) -> Vec<T> {
    let mut vec = vec_on_large_pages(len);
    vec.resize(len, value);
    vec
}

/// A copy of `list` on large pages where the system has them.
pub(super) fn on_large_pages<T: Clone>(list: &[T]) -> Vec<T> {
    let mut vec = vec_on_large_pages(list.len());
    vec.extend_from_slice(list);
    vec
}
