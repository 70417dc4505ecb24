//! Graphs of things which are made of others: materials, textures, meshes.
//!
//! What is asked of such a graph (does it hold a spectrum, how bright can it be) is answered for each node once, from
//! the answers of its parts: in the order of [`parts_first`] these are there already. Following the references instead
//! asks for a part as often as ways lead to it, which doubles with every node both of whose parts are the next one.
//!
//! What is looked up at a point follows the references by recursion, so that they are followed to a stated depth only.

/// So many nodes may be made of one another in a row. Deeper than any scene, and safe for recursion: a lookup of a
/// texture takes less than 8 kB of stack for each, without optimisation, of the 2 MiB that a thread has.
pub const MAX_PARTS_DEPTH: u32 = 128;

/// Why nodes cannot be put in an order, or not be looked up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GraphFault {
    /// This node is made of itself.
    Cycle(u32),
    /// More than [`MAX_PARTS_DEPTH`] nodes are made of one another, from this one on; its parts are not too many.
    TooDeep(u32),
}

/// The nodes in an order in which each comes after its parts; `parts` are the nodes that a node refers to.
///
/// # Errors
/// The first node which is made of itself, else the first that is too deep.
///
/// # Panics
/// If a part is out of range.
pub fn parts_first(count: u32, parts: impl Fn(u32) -> Vec<u32>) -> Result<Vec<u32>, GraphFault> {
    let mut order = Vec::with_capacity(count as usize);
    let (mut opened, mut done) = (vec![false; count as usize], vec![false; count as usize]);
    let mut depth = vec![1_u32; count as usize];
    for start in 0..count {
        // Depth first, without recursion. What is left of the parts of each node on the way.
        let mut way: Vec<(u32, Vec<u32>)> = Vec::new();
        if !done[start as usize] {
            opened[start as usize] = true;
            way.push((start, parts(start)));
        }
        while let Some((node, open)) = way.last_mut() {
            let node = *node;
            match open.pop() {
                Some(part) if done[part as usize] => {
                    depth[node as usize] = depth[node as usize].max(depth[part as usize] + 1);
                }
                Some(part) if opened[part as usize] => return Err(GraphFault::Cycle(part)),
                Some(part) => {
                    // It is looked at again when it is done, for its depth.
                    open.push(part);
                    opened[part as usize] = true;
                    way.push((part, parts(part)));
                }
                None => {
                    done[node as usize] = true;
                    order.push(node);
                    way.pop();
                }
            }
        }
    }
    match order.iter().find(|&&node| depth[node as usize] > MAX_PARTS_DEPTH) {
        Some(&node) => Err(GraphFault::TooDeep(node)),
        None => Ok(order),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Oracle: the places in the order, looked at edge by edge; both parts of each node are later ones.
    #[test]
    fn parts_come_before_what_is_made_of_them() {
        let parts = |node: u32| {
            let below = [2 * node + 1, 2 * node + 2, node + 1, node + 1];
            below.into_iter().filter(|&part| part < 100).collect()
        };
        let order = parts_first(100, parts).expect("all parts are later ones");
        let place = |node: u32| order.iter().position(|&n| n == node).expect("each is there");
        assert_eq!(order.len(), 100);
        for node in 0..100 {
            assert!(parts(node).into_iter().all(|part| place(part) < place(node)));
        }
    }

    #[test]
    fn cycles_are_found() {
        let ring = |node: u32| vec![(node + 1) % 4];
        assert_eq!(parts_first(4, ring), Err(GraphFault::Cycle(0)));
        assert_eq!(parts_first(2, |_| vec![1]), Err(GraphFault::Cycle(1)));
    }

    /// A chain of a million is looked through without recursion; the first node that has too many below it is told.
    #[test]
    fn chains_are_followed_to_a_stated_depth() {
        let chain = |count: u32| {
            move |node: u32| (node + 1 < count).then_some(node + 1).into_iter().collect()
        };
        assert!(parts_first(MAX_PARTS_DEPTH, chain(MAX_PARTS_DEPTH)).is_ok());
        let count = 1_000_000;
        let first = count - 1 - MAX_PARTS_DEPTH;
        assert_eq!(parts_first(count, chain(count)), Err(GraphFault::TooDeep(first)));
    }
}
