//! Files that no glob matches: those that a stage reads, looks for or lists.

use super::*;

each_way! {
    fn a_file_that_a_stage_read_changes(way: Way) {
        let project = capitals();
        project.write("in/sky.txt", "include ../parts/cloud.part\n");
        project.write("parts/cloud.part", "soft");
        let watched = Watched::new(&project, way);
        watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "SOFT")]);
        project.write("parts/cloud.part", "dark");
        watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "DARK")]);
        assert!(watched.noticed().iter().all(|(path, _)| path.ends_with("cloud.part")), "{:?}", watched.noticed());
    }

    fn a_file_that_was_looked_for_appears(way: Way) {
        let project = capitals();
        project.write("in/sky.txt", "include ../far/away/cloud\n");
        let watched = Watched::new(&project, way);
        watched.until_out(&[("gold.txt", "WARM")]);
        project.write("far/away/cloud", "dark");
        watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "DARK")]);
    }

    fn a_file_that_a_stage_begins_to_read_is_watched(way: Way) {
        let project = capitals();
        project.write("parts/cloud", "soft");
        let watched = Watched::new(&project, way);
        project.write("in/sky.txt", "include ../parts/cloud\n");
        watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "SOFT")]);
        project.write("parts/cloud", "dark");
        watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "DARK")]);
    }

    fn a_folder_that_a_stage_lists(way: Way) {
        let project = Project::new(&CAPITALS.replace("in/*.txt", "faces"));
        project.write("faces/a", "");
        let watched = Watched::new(&project, way);
        watched.until_out(&[("faces.txt", "A")]);
        project.write("faces/b", "");
        watched.until_out(&[("faces.txt", "A\nB")]);
        project.remove("faces/a");
        watched.until_out(&[("faces.txt", "B")]);
    }

    /// The glob searches the folder that the engine writes to.
    fn files_that_the_engine_writes_are_not_changes(way: Way) {
        let project = Project::new(&CAPITALS.replace("in/*.txt", "**/*.txt"));
        project.write("sky.txt", "blue");
        let watched = Watched::new(&project, way);
        for text in ["grey", "red"] {
            save(&project, "sky.txt", text);
            watched.until_out(&[("sky.txt", &text.to_uppercase())]);
        }
        let events = watched.events();
        assert!(changes(&events).all(|(path, _)| path == "sky.txt"), "{}", log(&events));
        let built = summaries(&events).filter(|summary| summary.ran > 0).count();
        assert_eq!(built, 3, "{}", log(&events));
    }
}
