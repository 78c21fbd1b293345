//! Orders stages so that each comes after those that it needs, and finds the cycles that make this
//! impossible.
//!
//! The order is Kahn's algorithm's; of several stages that are ready it takes the one that comes first in the
//! manifest. The stages that are left contain every cycle: Tarjan's algorithm, with an explicit stack, finds
//! their strongly connected components, and a breadth-first search finds the shortest cycle through the first
//! stage of each.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap, VecDeque};

use super::index::StageIndex;

/// All stages in topological order, given what each needs, and a cycle of each strongly connected component.
/// Stages that are in a cycle, or after one, come last.
pub(crate) fn order(needs: &[Vec<StageIndex>]) -> (Vec<StageIndex>, Vec<Vec<StageIndex>>) {
    let mut order = topological(needs);
    let mut is_left = vec![true; needs.len()];
    order.iter().for_each(|&stage| is_left[stage] = false);
    let cycles = components(needs, &is_left).into_iter().map(|members| shortest_cycle(needs, &members));
    let cycles = cycles.filter(|cycle| !cycle.is_empty()).collect();
    order.extend((0..needs.len()).filter(|&stage| is_left[stage]));
    (order, cycles)
}

fn topological(needs: &[Vec<StageIndex>]) -> Vec<StageIndex> {
    let mut missing: Vec<usize> = needs.iter().map(Vec::len).collect();
    let mut needed_by = vec![Vec::new(); needs.len()];
    for (stage, needs) in needs.iter().enumerate() {
        needs.iter().for_each(|&from| needed_by[from].push(stage));
    }
    let ready = (0..needs.len()).filter(|&stage| missing[stage] == 0);
    let mut ready: BinaryHeap<_> = ready.map(Reverse).collect();
    let mut order = Vec::new();
    while let Some(Reverse(stage)) = ready.pop() {
        order.push(stage);
        for &next in &needed_by[stage] {
            missing[next] -= 1;
            if missing[next] == 0 {
                ready.push(Reverse(next));
            }
        }
    }
    order
}

/// The strongly connected components of the stages that are left, in the order of their first member.
fn components(needs: &[Vec<StageIndex>], is_left: &[bool]) -> Vec<Vec<StageIndex>> {
    const UNSEEN: usize = usize::MAX;
    let (mut index, mut low) = (vec![UNSEEN; needs.len()], vec![0; needs.len()]);
    let (mut open, mut is_open) = (Vec::new(), vec![false; needs.len()]);
    let (mut next, mut found) = (0, Vec::new());
    for root in (0..needs.len()).filter(|&stage| is_left[stage]) {
        if index[root] != UNSEEN {
            continue;
        }
        let mut calls = vec![(root, 0)];
        while let Some((stage, edge)) = calls.pop() {
            if edge == 0 {
                (index[stage], low[stage]) = (next, next);
                next += 1;
                open.push(stage);
                is_open[stage] = true;
            } else {
                low[stage] = low[stage].min(low[needs[stage][edge - 1]]);
            }
            let mut edges = edge..needs[stage].len();
            let unseen = edges.find(|&edge| {
                let from = needs[stage][edge];
                if is_open[from] {
                    low[stage] = low[stage].min(index[from]);
                }
                is_left[from] && index[from] == UNSEEN
            });
            if let Some(edge) = unseen {
                calls.push((stage, edge + 1));
                calls.push((needs[stage][edge], 0));
            } else if low[stage] == index[stage] {
                let start = open.iter().rposition(|&member| member == stage).unwrap_or_default();
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

/// The shortest way from the first member through what it needs back to itself, without the repetition; empty
/// if there is no way.
fn shortest_cycle(needs: &[Vec<StageIndex>], members: &[StageIndex]) -> Vec<StageIndex> {
    let first = members[0];
    let mut came_from = HashMap::new();
    let mut queue = VecDeque::from([first]);
    while let Some(stage) = queue.pop_front() {
        for &from in &needs[stage] {
            if from == first {
                let mut cycle = vec![stage];
                while let Some(&previous) = came_from.get(&cycle[cycle.len() - 1]) {
                    cycle.push(previous);
                }
                cycle.reverse();
                return cycle;
            }
            if !came_from.contains_key(&from) && members.binary_search(&from).is_ok() {
                came_from.insert(from, stage);
                queue.push_back(from);
            }
        }
    }
    Vec::new()
}
