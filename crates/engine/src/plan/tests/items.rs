//! The items of stages, their keys and their inputs.

use super::*;

#[test]
fn a_glob_gives_an_item_for_each_file_and_a_literal_gives_one() {
    check_items(
        "skies/noon.txt skies/.hidden.txt skies/dawn.txt skies/dawn.txt~ skies/noon.txt.bak skies/deep/no.txt one.v2.txt faces.d/px.txt ../far/x.txt",
        r#"
[stage]
sky = { kind = "text-source", source = "skies/*.txt" }
one = { kind = "text-source", source = "./one.v2.txt" }
folder = { kind = "text-source", source = "faces.d" }
far = { kind = "text-source", source = "../far/*" }
"#,
        expect![[r#"
            sky[dawn] < /project/skies/dawn.txt
            sky[noon] < /project/skies/noon.txt
            one[one.v2] < /project/one.v2.txt
            folder[faces.d] < /project/faces.d
            far[x] < /project/../far/x.txt
        "#]],
    );
}

#[test]
fn keys_of_one_source_agree_and_others_multiply() {
    let manifest = r#"
[stage]
mixed = { kind = "concat", inputs = { left = "sky", right = "paint" } }
loud = { kind = "upper", input = "sky" }
again = { kind = "concat", inputs = { right = "loud", left = "mixed" } }
"#;
    check_items(
        FILES,
        &format!("{SOURCES}{manifest}"),
        expect![[r#"
        sky[dawn] < /project/skies/dawn.txt
        sky[noon] < /project/skies/noon.txt
        paint[gold] < /project/paints/gold.txt
        paint[red] < /project/paints/red.txt
        mixed[gold, dawn] left=sky[dawn] right=paint[gold]
        mixed[gold, noon] left=sky[noon] right=paint[gold]
        mixed[red, dawn] left=sky[dawn] right=paint[red]
        mixed[red, noon] left=sky[noon] right=paint[red]
        loud[dawn] text=sky[dawn]
        loud[noon] text=sky[noon]
        again[gold, dawn] left=mixed[gold, dawn] right=loud[dawn]
        again[gold, noon] left=mixed[gold, noon] right=loud[noon]
        again[red, dawn] left=mixed[red, dawn] right=loud[dawn]
        again[red, noon] left=mixed[red, noon] right=loud[noon]
    "#]],
    );
}

#[test]
fn a_port_that_takes_many_receives_what_agrees() {
    let manifest = r#"
[stage]
mixed = { kind = "concat", inputs = { left = "sky", right = "paint" } }
all = { kind = "collect", input = "mixed" }
for-each-sky = { kind = "collect", inputs = { texts = "mixed", title = "sky" } }
for-each-paint = { kind = "collect", input = "mixed", per = ["paint"] }
crossed = { kind = "collect", inputs = { texts = "paint", title = "sky" } }
"#;
    check_items(
        FILES,
        &format!("{SOURCES}{manifest}"),
        expect![[r#"
        sky[dawn] < /project/skies/dawn.txt
        sky[noon] < /project/skies/noon.txt
        paint[gold] < /project/paints/gold.txt
        paint[red] < /project/paints/red.txt
        mixed[gold, dawn] left=sky[dawn] right=paint[gold]
        mixed[gold, noon] left=sky[noon] right=paint[gold]
        mixed[red, dawn] left=sky[dawn] right=paint[red]
        mixed[red, noon] left=sky[noon] right=paint[red]
        all[] texts=mixed[gold, dawn]+mixed[gold, noon]+mixed[red, dawn]+mixed[red, noon]
        for-each-sky[dawn] texts=mixed[gold, dawn]+mixed[red, dawn] title=sky[dawn]
        for-each-sky[noon] texts=mixed[gold, noon]+mixed[red, noon] title=sky[noon]
        for-each-paint[gold] texts=mixed[gold, dawn]+mixed[gold, noon]
        for-each-paint[red] texts=mixed[red, dawn]+mixed[red, noon]
        crossed[dawn] texts=paint[gold]+paint[red] title=sky[dawn]
        crossed[noon] texts=paint[gold]+paint[red] title=sky[noon]
    "#]],
    );
}

#[test]
fn stages_may_be_in_any_order() {
    check_items(
        "a.txt",
        r#"
[stage]
file = { kind = "write", input = "loud" }
loud = { kind = "upper", input = "text" }
other = { kind = "upper", input = "text" }
text = { kind = "text-source", source = "a.txt" }
"#,
        expect![[r#"
            text[a] < /project/a.txt
            loud[a] text=text[a]
            file[a] value=loud[a] > file/a.txt
            other[a] text=text[a]
        "#]],
    );
}

#[test]
fn a_join_gives_what_comparing_all_pairs_gives() {
    let names =
        |folder: &str, count: usize| (0..count).map(|i| format!("{folder}/{i}.txt ")).collect::<String>();
    let files = names("skies", 5) + &names("paints", 7);
    let manifest = r#"
[stage]
mixed = { kind = "concat", inputs = { left = "paint", right = "sky" } }
three = { kind = "concat", inputs = { left = "mixed", right = "sky", end = "paint" } }
"#;
    let plan = load(&files, &format!("{SOURCES}{manifest}")).unwrap();
    let of = |name: &'static str| {
        let stages = &plan.stages;
        plan.items.iter().filter(move |item| stages[item.stage].name == name)
    };
    let agree =
        |a: &ItemKey, b: &ItemKey| a.iter().all(|(name, stem)| b.get(name).is_none_or(|own| own == stem));
    let mut expected = Vec::new();
    for mixed in of("mixed") {
        for sky in of("sky").filter(|sky| agree(&sky.key, &mixed.key)) {
            for paint in of("paint").filter(|paint| agree(&paint.key, &mixed.key)) {
                expected.push((mixed.key.clone(), sky.key.clone(), paint.key.clone()));
            }
        }
    }
    expected.sort();
    let key = |items: &Vec<ItemIndex>| plan.items[items[0]].key.clone();
    let found: Vec<_> =
        of("three").map(|item| (key(&item.inputs[0]), key(&item.inputs[1]), key(&item.inputs[2]))).collect();
    assert_eq!(found, expected);
    assert_eq!(found.len(), 35);
    for item in of("three") {
        assert!(item.inputs.iter().all(|port| port.len() == 1 && agree(&plan.items[port[0]].key, &item.key)));
    }
}
