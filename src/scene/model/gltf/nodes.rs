//! The tree of nodes with their transforms to the world.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DAffine3, DMat4};

/// Adds the transforms of nodes that the shown scene has not: joints may be among them.
pub(super) fn add_unshown(document: &gltf::Document, worlds: &mut BTreeMap<usize, DAffine3>) {
    let below: BTreeSet<usize> =
        document.nodes().flat_map(|node| node.children().map(|child| child.index())).collect();
    let others = document.nodes().filter(|node| !below.contains(&node.index()));
    let others: Vec<_> = others.filter(|node| !worlds.contains_key(&node.index())).collect();
    // Nodes that form no tree have no transforms.
    for (node, to_world) in visit(others).unwrap_or_default() {
        worlds.entry(node.index()).or_insert(to_world);
    }
}

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
