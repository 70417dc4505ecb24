//! Numbers of objects, as the layer `ObjectId` has them.
//!
//! A number follows from the name of its object alone, so that it is the same in every frame, and stays when other objects
//! come or go: 24 bits of a hash of the name, which a 32-bit float, as many programs keep it, still holds exactly. Where two
//! names agree in these, the later one in the order of names takes 32 bits of another hash; among a thousand objects
//! that happens in one scene of 34.

use std::collections::HashSet;
use xxhash_rust::xxh3::xxh3_64_with_seed;

/// A number from 1 for each of these names, which are sorted; equal ones, such as those of nameless objects, have numbers
/// of their own.
pub fn object_ids<'a>(names: impl IntoIterator<Item = &'a str>) -> impl Iterator<Item = u32> {
    let mut taken = HashSet::new();
    let mut before = None;
    let mut repeated = 0_u64;
    names.into_iter().map(move |name| {
        repeated = if before == Some(name) { repeated + 1 } else { 0 };
        before = Some(name);
        let mut attempt = 0_u64;
        loop {
            let hash = xxh3_64_with_seed(name.as_bytes(), repeated << 32 | attempt);
            let id = (hash >> if attempt == 0 { 40 } else { 32 }) as u32;
            if id != 0 && taken.insert(id) {
                return id;
            }
            attempt += 1;
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    /// Ten thousand names, among which some agree in 24 bits (10⁸/2/2²⁴ ≈ 3 pairs), and a hundred nameless objects: all
    /// numbers differ, but for the few of those pairs none is beyond what a float holds, and without every second object
    /// the others keep theirs.
    #[test]
    fn numbers_differ_and_stay_when_others_go() {
        let mut names: Vec<String> = (0..10_000).map(|k| format!("leaf {k}")).collect();
        names.extend((0..100).map(|_| String::new()));
        names.sort();
        let ids: Vec<u32> = object_ids(names.iter().map(String::as_str)).collect();
        let distinct: HashSet<u32> = ids.iter().copied().collect();
        assert_eq!(distinct.len(), names.len());
        assert!(!distinct.contains(&0));
        let large = ids.iter().filter(|id| **id as f32 as u32 != **id).count();
        assert!(large <= 20, "{large}");
        let known: HashMap<&str, u32> = names.iter().map(String::as_str).zip(ids).collect();
        let some: Vec<&str> = names.iter().skip(100).step_by(2).map(String::as_str).collect();
        let kept = some.iter().zip(object_ids(some.iter().copied()));
        let moved = kept.filter(|(name, id)| known[**name] != *id).count();
        assert!(moved <= large, "{moved}");
    }
}
