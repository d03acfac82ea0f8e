use std::fs::{self, File};

use files::temporary::{Folder, PREFIX, remove_all};

#[test]
fn temporary_folders_of_ended_programs_are_removed_and_others_stay() {
    let parent = tempfile::tempdir().unwrap();
    let [dead, living, other] =
        ["hubslosh-dead", "hubslosh-living", "hubslosh-other"].map(|name| parent.path().join(name));
    for folder in [&dead, &living, &other] {
        fs::create_dir_all(folder.join("files")).unwrap();
    }
    File::create(dead.join("alive")).unwrap();
    let held = File::create(living.join("alive")).unwrap();
    held.lock().unwrap();
    // Creating a folder removes the abandoned folders of its parent.
    Folder::new_in(parent.path(), PREFIX).unwrap();
    assert!(!dead.exists() && living.exists());
    assert!(other.exists(), "a folder without the file alive belongs to another program");
}

#[test]
fn a_dropped_temporary_folder_is_removed() {
    let folder = Folder::new().unwrap();
    let path = folder.path().to_path_buf();
    fs::write(path.join("a"), "a").unwrap();
    drop(folder);
    assert!(!path.parent().unwrap().exists());
}

/// The process of the test starts a second one, because [`remove_all`] leaves the list of folders locked.
#[test]
fn a_signal_removes_the_temporary_folders_that_exist_and_no_others() {
    const CHILD: &str = "process_that_ends";
    if std::env::args().any(|argument| argument == CHILD) {
        let dropped = Folder::new().unwrap();
        let past = dropped.path().to_path_buf();
        drop(dropped);
        fs::create_dir_all(&past).unwrap();
        let folder = Folder::new().unwrap();
        remove_all();
        let is_right = past.exists() && !folder.path().exists();
        fs::remove_dir_all(past.parent().unwrap()).unwrap();
        std::process::exit(i32::from(!is_right));
    }
    let name = "temporary::a_signal_removes_the_temporary_folders_that_exist_and_no_others";
    let mut child = std::process::Command::new(std::env::current_exe().unwrap());
    assert!(child.args(["--exact", name, CHILD]).status().unwrap().success());
}
