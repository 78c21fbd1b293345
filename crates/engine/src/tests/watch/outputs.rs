//! Exported files that somebody removes while the watcher is idle.

use super::*;

const OUT: [(&str, &str); 2] = [("gold/loud.txt", "WARM"), ("sky/loud.txt", "BLUE")];

fn project() -> Project {
    let project = Project::new(&CAPITALS.replace("{text}", "{text}/loud"));
    project.write("in/sky.txt", "blue");
    project.write("in/gold.txt", "warm");
    project
}

/// Waits until a watcher has built, and forgets what happened until then.
fn idle(project: &Project, way: Way) -> Watched<'_> {
    let watched = Watched::new(project, way);
    watched.until_out(&OUT);
    // The folders of the exported files are watched after the build.
    std::thread::sleep(Duration::from_millis(100));
    watched.log.events.lock().clear();
    watched
}

each_way! {
    fn the_folder_for_exports_deleted(way: Way) {
        let project = project();
        let watched = idle(&project, way);
        for _ in 0..2 {
            if !project.removes("out") {
                return test_data::skip("the_folder_for_exports_deleted", KEPT);
            }
            watched.until_out(&OUT);
            assert_eq!(watched.noticed(), [("out".to_owned(), Changed::Gone)]);
        }
        let summary = summaries(&watched.events()).last().unwrap().clone();
        assert_eq!((summary.ran, summary.published), (0, 2));
    }

    fn a_folder_of_exports_moved_away(way: Way) {
        let project = project();
        let watched = idle(&project, way);
        project.rename("out/sky", "kept");
        watched.until_out(&OUT);
        assert_eq!(watched.noticed(), [("out/sky".to_owned(), Changed::Gone)]);
        assert_eq!(project.read("kept/loud.txt"), "BLUE");
    }

    fn everything_that_git_ignores_deleted(way: Way) {
        let project = project();
        let watched = idle(&project, way);
        project.remove(".specula");
        if !project.removes("out") {
            return test_data::skip("everything_that_git_ignores_deleted", KEPT);
        }
        watched.until_out(&OUT);
        assert!(project.exists(".specula/journal"));
    }

    fn files_of_an_item_that_has_gone_do_not_come_back(way: Way) {
        let project = project();
        let watched = idle(&project, way);
        project.remove("in/sky.txt");
        watched.until_out(&OUT[..1]);
        std::thread::sleep(Duration::from_millis(500));
        assert_eq!(watched.noticed(), [("in/sky.txt".to_owned(), Changed::Gone)], "{}", log(&watched.events()));
    }
}

#[test]
fn a_single_file_deleted() {
    let project = project();
    let watched = idle(&project, Way::Listening);
    project.remove("out/sky/loud.txt");
    watched.until_out(&OUT);
    assert_eq!(watched.noticed(), [("out/sky/loud.txt".to_owned(), Changed::Gone)]);
}

/// What others put there, and take away again, is not the watcher's business.
#[test]
fn a_file_of_somebody_else_does_not_come_back() {
    let project = project();
    let watched = idle(&project, Way::Listening);
    project.write("out/notes.txt", "");
    project.remove("out/notes.txt");
    project.rename("in/gold.txt", "in/gold.txt~");
    watched.until_out(&OUT[1..]);
    assert_eq!(watched.noticed(), [("in/gold.txt".to_owned(), Changed::Gone)]);
}

#[test]
fn folders_of_exports_that_were_never_made_are_not_missed() {
    let project = project();
    project.edit("kind = \"upper\"", "kind = \"refuse\"");
    project.write("in/rain.txt", "bad");
    let watched = Watched::new(&project, Way::Polling);
    watched.until_out(&[("gold/loud.txt", "warm"), ("sky/loud.txt", "blue")]);
    std::thread::sleep(Duration::from_millis(800));
    assert_eq!(watched.noticed(), []);
}
