//! The tree of nodes with their transforms to the world.

use std::collections::BTreeSet;

use glam::{DAffine3, DMat4};

pub(super) type PlacedNode<'a> = (gltf::Node<'a>, DAffine3);

/// All nodes below these with their transforms to the world; an error where one is reached twice.
pub(super) fn visit(roots: Vec<gltf::Node<'_>>) -> Result<Vec<PlacedNode<'_>>, String> {
    let mut open: Vec<PlacedNode<'_>> =
        roots.into_iter().rev().map(|node| (node, DAffine3::IDENTITY)).collect();
    let (mut seen, mut nodes) = (BTreeSet::new(), Vec::new());
    while let Some((node, parent)) = open.pop() {
        if !seen.insert(node.index()) {
            let message =
                format!("nodes[{}] is below itself, or below two others: nodes form a tree", node.index());
            return Err(message);
        }
        let matrix = DMat4::from_cols_array_2d(&node.transform().matrix().map(|c| c.map(f64::from)));
        let to_world = parent * DAffine3::from_mat4(matrix);
        let at = open.len();
        open.extend(node.children().map(|child| (child, to_world)));
        open[at..].reverse();
        nodes.push((node, to_world));
    }
    Ok(nodes)
}
