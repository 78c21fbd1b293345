//! What a timeline records of events, and how it is drawn.

use std::time::Instant;

use engine::{Event, ItemKey, ItemName, Summary, Timestamp, Work};
use serde_json::Value;

use super::timeline::{Index, ItemOutcome, TimelineItem};
use super::*;

/// Items that each need the one before, with this work: item, worker, start and end.
fn timeline(items: usize, work: &[(Index, usize, f64, f64)]) -> Timeline {
    let name = |item: usize| ItemName { stage: format!("a<{item}>"), key: ItemKey::default() };
    let mut timeline = Timeline {
        manifest: "pipeline.toml".into(),
        began: Timestamp(0),
        clock: Instant::now(),
        indices: (0..items).map(|item| (name(item), item)).collect(),
        nodes: (0..items)
            .map(|item| TimelineItem {
                stage: name(item).stage,
                name: name(item).to_string(),
                kind: format!("kind-{}", item % 3),
                needs: item.checked_sub(1).into_iter().collect(),
            })
            .collect(),
        outcomes: vec![ItemOutcome::NotReached; items],
        reasons: vec![String::new(); items],
        is_elsewhere: vec![false; items],
        spans: Vec::new(),
        summary: Summary::default(),
    };
    for &(item, worker, start, end) in work {
        timeline.record(&Event::Started {
            item: name(item),
            reasons: vec![engine::Reason::NeverBuilt],
            host: None,
        });
        let (start_milliseconds, milliseconds) = (start, end - start);
        let work = Work::Run;
        timeline.record(&Event::TaskTimed {
            item: name(item),
            work,
            worker,
            start_milliseconds,
            milliseconds,
        });
        timeline.record(&Event::Finished { item: name(item), milliseconds, changed: true });
    }
    timeline.settle();
    timeline
}

/// The bars of a page: the lane of each, its top in pixels, its left edge and width in percent.
fn drawn(page: &str) -> Vec<(usize, f64, f64, f64)> {
    let mut lane = 0;
    let mut found = Vec::new();
    for line in page.lines() {
        lane += usize::from(line.starts_with("<div class=\"lane\">"));
        if line.starts_with("<a class=\"bar ") {
            let number = |from: &str, to: &str| {
                line.split(from).nth(1).unwrap().split(to).next().unwrap().parse::<f64>().unwrap()
            };
            found.push((lane, number("top:", "px"), number("left:", "%"), number("width:", "%")));
        }
    }
    found
}

#[test]
fn nested_work_is_found_and_counted_once() {
    let timeline = timeline(4, &[(0, 0, 0.0, 10.0), (1, 0, 2.0, 5.0), (2, 0, 3.0, 4.0), (3, 1, 1.0, 2.0)]);
    let spans: Vec<_> =
        timeline.spans.iter().map(|span| (span.item, span.depth, span.own / 1_000_000)).collect();
    assert_eq!(spans, [(0, 0, 7), (1, 1, 2), (2, 2, 1), (3, 0, 1)]);
    assert_eq!((timeline.busy(0), timeline.busy(1)), (10_000_000, 1_000_000));
    assert_eq!(timeline.critical_path(), (vec![0, 1, 2, 3], 11_000_000));
    let kinds = [
        ("kind-0", 2, 8_000_000, 7_000_000),
        ("kind-1", 1, 2_000_000, 2_000_000),
        ("kind-2", 1, 1_000_000, 1_000_000),
    ];
    assert_eq!(timeline.kinds(), kinds);
}

#[test]
fn the_critical_path_is_the_slowest_chain() {
    let mut timeline =
        timeline(4, &[(0, 0, 0.0, 1.0), (1, 0, 1.0, 9.0), (2, 1, 1.0, 4.0), (3, 0, 9.0, 10.0)]);
    timeline.nodes[2].needs = vec![0];
    timeline.nodes[3].needs = vec![1, 2];
    assert_eq!(timeline.critical_path(), (vec![0, 1, 3], 10_000_000));
}

#[test]
fn rounding_makes_no_consecutive_work_overlap() {
    let thirds =
        (0..3000).map(|item| (item, 0, item as f64 / 3.0, (item + 1) as f64 / 3.0)).collect::<Vec<_>>();
    let timeline = timeline(3000, &thirds);
    assert!(timeline.spans.iter().all(|span| span.depth == 0));
}

#[test]
fn ten_thousand_items_need_few_bars_and_are_all_listed() {
    let work = (0..10_000).map(|item| (item, item % 2, item as f64, item as f64 + 1.9)).collect::<Vec<_>>();
    let mut timeline = timeline(10_000, &work);
    for item in (0..10_000).step_by(100) {
        timeline.outcomes[item] = ItemOutcome::UpToDate(item as u64 * 1_000_000);
    }
    let page = page::page(&timeline);
    let bars = drawn(&page);
    assert!((150..1500).contains(&bars.len()), "{} bars", bars.len());
    for pair in bars.windows(2).filter(|pair| (pair[0].0, pair[0].1 as i64) == (pair[1].0, pair[1].1 as i64))
    {
        // The numbers are rounded to a thousandth of a percent.
        assert!(pair[0].2 + pair[0].3 <= pair[1].2 + 0.0021, "{pair:?} overlap");
    }
    let rows = page.lines().filter(|line| line.starts_with("<tr id=\"item-"));
    let starts = (0..10_000).map(|item| format!("<tr id=\"item-{item}\"><td>a&lt;{item}&gt;</td>"));
    let starts = starts.collect::<Vec<_>>();
    assert_eq!(rows.clone().count(), starts.len());
    assert!(rows.zip(&starts).all(|(row, start)| row.starts_with(start.as_str())));
    assert!(page.len() < 4_000_000, "{} bytes", page.len());
}

#[test]
fn a_failure_is_never_hidden_by_its_neighbours() {
    let mut work =
        (0..1000).map(|item| (item, 0, item as f64 * 0.01, item as f64 * 0.01 + 0.009)).collect::<Vec<_>>();
    work.push((1000, 0, 20.0, 100.0));
    let mut timeline = timeline(1001, &work);
    timeline.outcomes[500] = ItemOutcome::Failed { error: "it & they".into(), hint: None };
    let page = page::page(&timeline);
    assert_eq!(page.matches("<a class=\"bar failed\"").count(), 1);
    assert!(page.contains("<tr id=\"item-500\" class=\"bad\">") && page.contains("it &amp; they"));
}

#[test]
fn an_item_that_was_stopped_differs_from_one_that_ran() {
    let mut timeline = timeline(2, &[(0, 0, 0.0, 1.0), (1, 0, 1.0, 2.0)]);
    timeline.record(&Event::Skipped {
        item: ItemName { stage: "a<1>".into(), key: ItemKey::default() },
        because: None,
    });
    let trace: Value = serde_json::from_str(&trace::trace(&timeline)).unwrap();
    let runs = trace["traceEvents"].as_array().unwrap().iter().filter(|event| event["ph"] == "X");
    let outcomes = runs.map(|event| event["args"]["outcome"].as_str().unwrap()).collect::<Vec<_>>();
    assert_eq!(outcomes, ["ran", "stopped"]);
    assert!(page::page(&timeline).contains("class=\"bar stopped\""));
}

#[test]
fn an_empty_build_has_a_page() {
    let timeline = timeline(0, &[]);
    assert!(page::page(&timeline).contains("What the workers did"));
    assert!(serde_json::from_str::<Value>(&trace::trace(&timeline)).is_ok());
}
