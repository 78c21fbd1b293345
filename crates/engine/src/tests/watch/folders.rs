//! Folders that appear, disappear and move, and links that are replaced.

use std::fs;

use super::*;

fn deep() -> Project {
    let project = Project::new(&CAPITALS.replace("in/*.txt", "in/**/*.txt"));
    project.write("in/sky.txt", "blue");
    project
}

each_way! {
    fn a_folder_made_and_written_to_at_once(way: Way) {
        let project = deep();
        let watched = Watched::new(&project, way);
        project.write("in/a/b/c/rain.txt", "wet");
        watched.until_out(&[("rain.txt", "WET"), ("sky.txt", "BLUE")]);
        project.write("in/a/b/snow.txt", "cold");
        watched.until_out(&[("rain.txt", "WET"), ("sky.txt", "BLUE"), ("snow.txt", "COLD")]);
    }

    fn a_folder_moved_away_and_back(way: Way) {
        let project = deep();
        project.write("in/a/b/rain.txt", "wet");
        let watched = Watched::new(&project, way);
        for text in ["one", "two"] {
            rename(&project, "in/a", "elsewhere");
            watched.until_out(&[("sky.txt", "BLUE")]);
            project.write("elsewhere/b/rain.txt", "written elsewhere");
            rename(&project, "elsewhere", "in/a");
            watched.until_out(&[("rain.txt", "WRITTEN ELSEWHERE"), ("sky.txt", "BLUE")]);
            project.write("in/a/b/rain.txt", text);
            watched.until_out(&[("rain.txt", &text.to_uppercase()), ("sky.txt", "BLUE")]);
        }
    }

    fn a_folder_moved_away_and_back_at_once(way: Way) {
        let project = deep();
        project.write("in/a/b/rain.txt", "wet");
        let watched = Watched::new(&project, way);
        rename(&project, "in/a", "elsewhere");
        rename(&project, "elsewhere", "in/a");
        project.write("in/a/b/rain.txt", "at once");
        watched.until_out(&[("rain.txt", "AT ONCE"), ("sky.txt", "BLUE")]);
        project.write("in/a/b/rain.txt", "later");
        watched.until_out(&[("rain.txt", "LATER"), ("sky.txt", "BLUE")]);
    }

    fn a_folder_renamed_within_the_glob(way: Way) {
        let project = deep();
        project.write("in/a/rain.txt", "wet");
        let watched = Watched::new(&project, way);
        rename(&project, "in/a", "in/z");
        watched.until("the change", |events| changes(events).count() > 0);
        project.write("in/z/rain.txt", "dry");
        watched.until_out(&[("rain.txt", "DRY"), ("sky.txt", "BLUE")]);
        project.write("in/a/snow.txt", "cold");
        watched.until_out(&[("rain.txt", "DRY"), ("sky.txt", "BLUE"), ("snow.txt", "COLD")]);
    }

    fn a_folder_deleted_and_made_again(way: Way) {
        let project = deep();
        project.write("in/a/rain.txt", "wet");
        let watched = Watched::new(&project, way);
        for text in ["one", "two", "three"] {
            project.remove("in/a");
            project.write("in/a/rain.txt", text);
            watched.until_out(&[("rain.txt", &text.to_uppercase()), ("sky.txt", "BLUE")]);
        }
    }

    fn the_searched_folder_itself_moved_away_and_back(way: Way) {
        let project = capitals();
        let watched = Watched::new(&project, way);
        rename(&project, "in", "elsewhere");
        watched.until("the error", |events| {
            events.iter().any(|event| matches!(event, Event::Rejected { .. }))
        });
        watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "BLUE")]);
        rename(&project, "elsewhere", "in");
        watched.until("it is accepted", |events| events.contains(&Event::Accepted));
        project.write("in/sky.txt", "grey");
        watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "GREY")]);
    }

    fn a_folder_outside_the_project(way: Way) {
        let library = tempfile::tempdir().unwrap();
        fs::write(library.path().join("sky.txt"), "blue").unwrap();
        let name = library.path().file_name().unwrap().to_string_lossy().into_owned();
        let project = Project::new(&CAPITALS.replace("in/", &format!("../{name}/")));
        let watched = Watched::new(&project, way);
        fs::write(library.path().join("sky.txt"), "grey").unwrap();
        watched.until_out(&[("sky.txt", "GREY")]);
        fs::write(library.path().join("rain.txt"), "wet").unwrap();
        watched.until_out(&[("rain.txt", "WET"), ("sky.txt", "GREY")]);
    }
}

#[cfg(unix)]
mod links {
    use std::os::unix::fs::symlink;

    use super::*;

    /// Replaces a link in one step.
    fn relink(project: &Project, target: &str, link: &str) {
        symlink(target, project.path("new-link")).unwrap();
        rename(project, "new-link", link);
    }

    each_way! {
        fn a_link_to_a_file_is_replaced(way: Way) {
            let project = Project::new(CAPITALS);
            project.write("store/one.dat", "one");
            project.write("store/two.dat", "two");
            project.write("in/gold.txt", "warm");
            symlink("../store/one.dat", project.path("in/sky.txt")).unwrap();
            let watched = Watched::new(&project, way);
            project.write("store/one.dat", "uno");
            watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "UNO")]);
            relink(&project, "../store/two.dat", "in/sky.txt");
            watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "TWO")]);
            project.write("store/two.dat", "due");
            watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "DUE")]);
            assert!(watched.noticed().iter().all(|(path, _)| path == "in/sky.txt"), "{:?}", watched.noticed());
        }

        fn a_link_to_the_searched_folder_is_replaced(way: Way) {
            let project = Project::new(CAPITALS);
            project.write("one/sky.txt", "one");
            project.write("two/sky.txt", "two");
            symlink("one", project.path("in")).unwrap();
            let watched = Watched::new(&project, way);
            project.write("one/sky.txt", "uno");
            watched.until_out(&[("sky.txt", "UNO")]);
            relink(&project, "two", "in");
            watched.until_out(&[("sky.txt", "TWO")]);
            project.write("two/sky.txt", "due");
            project.write("two/rain.txt", "wet");
            watched.until_out(&[("rain.txt", "WET"), ("sky.txt", "DUE")]);
        }

        fn a_link_in_the_middle_of_a_chain_is_replaced(way: Way) {
            let project = Project::new(CAPITALS);
            project.write("v1/sky.txt", "one");
            project.write("v2/sky.txt", "two");
            symlink("v1", project.path("current")).unwrap();
            symlink(project.path("current"), project.path("in")).unwrap();
            let watched = Watched::new(&project, way);
            watched.until_out(&[("sky.txt", "ONE")]);
            relink(&project, "v2", "current");
            watched.until_out(&[("sky.txt", "TWO")]);
        }

        fn the_target_of_a_dangling_link_appears(way: Way) {
            let project = capitals();
            symlink("../store/rain.dat", project.path("in/rain.txt")).unwrap();
            let watched = Watched::new(&project, way);
            project.write("store/rain.dat", "wet");
            watched.until_out(&[("gold.txt", "WARM"), ("rain.txt", "WET"), ("sky.txt", "BLUE")]);
        }
    }
}
