//! Vector instructions beyond those that every processor of the target has, chosen at run time.
//!
//! Work that is written as loops over lanes becomes vectors twice as wide with AVX2. Nothing else changes: the
//! same operations in the same order, none of them fused, give the same bits.
#![expect(unsafe_code, reason = "instructions which are used only where the processor has them")]
#![cfg_attr(test, expect(clippy::inline_always, reason = "as the trait asks"))]

/// Work that gains from wide vectors.
pub(crate) trait Lanewise {
    /// What comes of it.
    type Output;

    /// Does the work. To be inlined always, as all that it calls and that is to gain: what is not
    /// inlined is compiled for any processor.
    fn run(self) -> Self::Output;
}

/// Does the work with the widest vectors of this processor.
#[inline]
pub(crate) fn widest<W: Lanewise>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    if has_avx2() {
        // SAFETY: the features were detected.
        return unsafe { with_avx2(work) };
    }
    work.run()
}

/// Whether this processor has AVX2, and what has come with it in all processors.
#[cfg(target_arch = "x86_64")]
#[inline]
pub(crate) fn has_avx2() -> bool {
    // One flag for all of them: every ray asks.
    static PRESENT: std::sync::LazyLock<bool> = std::sync::LazyLock::new(|| {
        is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("popcnt")
    });
    *PRESENT
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,popcnt")]
fn with_avx2<W: Lanewise>(work: W) -> W::Output {
    work.run()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;

    struct Sums([f32; 8], [f32; 8]);

    impl Lanewise for Sums {
        type Output = [f32; 8];

        #[inline(always)]
        fn run(self) -> [f32; 8] {
            std::array::from_fn(|k| self.0[k] * self.1[k] + self.0[7 - k])
        }
    }

    /// Oracle: the same work without the instructions, for numbers whose products are rounded.
    #[test]
    fn wide_vectors_give_the_same_bits() {
        for k in 0..10_000 {
            let s = Sampler::new(1, 0, (k, 0), 0);
            let lanes = |from| std::array::from_fn(|k| s.one(from + k as u32) - 0.5);
            assert_eq!(widest(Sums(lanes(0), lanes(8))), Sums(lanes(0), lanes(8)).run());
        }
    }
}
