//! The order of stages, each after those that it needs; and where there is none, the circle that forbids it.
//!
//! Kahn's algorithm, which of several ready stages takes the one that stands first in the manifest. What is left holds
//! every cycle: its strongly connected components (Tarjan's algorithm, with a stack of its own) tell them apart, and
//! a search in breadth finds the shortest circle through the first stage of each.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap, VecDeque};

use super::graph::{Node, Place};
use super::source::listed;
use crate::Diagnostic;

/// The places of all stages in topological order, with what is in or after a cycle at the end.
pub(crate) fn order(nodes: &[Node], faults: &mut Vec<Diagnostic>) -> Vec<Place> {
    let needs: Vec<Vec<Place>> =
        nodes.iter().map(|node| node.edges.iter().map(|edge| edge.from).collect()).collect();
    let mut order = topological(&needs);
    if order.len() < nodes.len() {
        let mut left = vec![true; nodes.len()];
        order.iter().for_each(|&place| left[place] = false);
        for members in components(&needs, &left) {
            let circle = shortest_circle(&needs, &members);
            if !circle.is_empty() {
                faults.push(fault(nodes, &circle));
            }
        }
        order.extend((0..nodes.len()).filter(|&place| left[place]));
    }
    order
}

fn topological(needs: &[Vec<Place>]) -> Vec<Place> {
    let mut waits: Vec<usize> = needs.iter().map(Vec::len).collect();
    let mut needed_by = vec![Vec::new(); needs.len()];
    for (place, needs) in needs.iter().enumerate() {
        needs.iter().for_each(|&from| needed_by[from].push(place));
    }
    let mut ready: BinaryHeap<_> = (0..needs.len()).filter(|&place| waits[place] == 0).map(Reverse).collect();
    let mut order = Vec::new();
    while let Some(Reverse(place)) = ready.pop() {
        order.push(place);
        for &next in &needed_by[place] {
            waits[next] -= 1;
            if waits[next] == 0 {
                ready.push(Reverse(next));
            }
        }
    }
    order
}

/// The strongly connected components of the places that are left, in the order of their first member.
fn components(needs: &[Vec<Place>], left: &[bool]) -> Vec<Vec<Place>> {
    const UNSEEN: usize = usize::MAX;
    let (mut index, mut low) = (vec![UNSEEN; needs.len()], vec![0; needs.len()]);
    let (mut open, mut is_open) = (Vec::new(), vec![false; needs.len()]);
    let (mut next, mut found) = (0, Vec::new());
    for root in (0..needs.len()).filter(|&place| left[place]) {
        if index[root] != UNSEEN {
            continue;
        }
        let mut calls = vec![(root, 0)];
        while let Some((place, edge)) = calls.pop() {
            if edge == 0 {
                (index[place], low[place]) = (next, next);
                next += 1;
                open.push(place);
                is_open[place] = true;
            } else {
                low[place] = low[place].min(low[needs[place][edge - 1]]);
            }
            let mut edges = edge..needs[place].len();
            let unseen = edges.find(|&edge| {
                let from = needs[place][edge];
                if is_open[from] {
                    low[place] = low[place].min(index[from]);
                }
                left[from] && index[from] == UNSEEN
            });
            if let Some(edge) = unseen {
                calls.push((place, edge + 1));
                calls.push((needs[place][edge], 0));
            } else if low[place] == index[place] {
                let start = open.iter().rposition(|&member| member == place).unwrap_or_default();
                let mut members = open.split_off(start);
                members.iter().for_each(|&member| is_open[member] = false);
                members.sort_unstable();
                found.push(members);
            }
        }
    }
    found.sort_unstable();
    found
}

/// From the first member through what it needs back to itself, without the repetition; empty if there is no way.
fn shortest_circle(needs: &[Vec<Place>], members: &[Place]) -> Vec<Place> {
    let first = members[0];
    let mut came_from = HashMap::new();
    let mut queue = VecDeque::from([first]);
    while let Some(place) = queue.pop_front() {
        for &from in &needs[place] {
            if from == first {
                let mut circle = vec![place];
                while let Some(&previous) = came_from.get(&circle[circle.len() - 1]) {
                    circle.push(previous);
                }
                circle.reverse();
                return circle;
            }
            if !came_from.contains_key(&from) && members.binary_search(&from).is_ok() {
                came_from.insert(from, place);
                queue.push_back(from);
            }
        }
    }
    Vec::new()
}

fn fault(nodes: &[Node], circle: &[Place]) -> Diagnostic {
    let (first, second) = (circle[0], circle[1 % circle.len()]);
    let node = &nodes[first];
    let span = node
        .edges
        .iter()
        .find(|edge| edge.from == second)
        .map_or(node.header.clone(), |edge| edge.span.clone());
    let name = |place: Place| nodes[place].name.clone();
    let fault = match circle {
        [_] => Diagnostic::at(span, format!("stage {:?} needs itself", name(first))),
        _ => {
            let rest = circle[1..].iter().chain([&first]).map(|&place| format!("needs {}", name(place)));
            let rest: Vec<_> = rest.collect();
            let long = rest.len() > 8;
            let way = if long { listed(rest) } else { rest.join(", which ") };
            Diagnostic::at(span, format!("stages need each other in a circle: {} {way}", name(first)))
        }
    };
    fault.expected("expected a stage that does not need this one")
}
