#![cfg(unix)]

use std::path::Path;

use host::fmi2::file_uri;

#[test]
fn the_uri_of_the_resources_is_percent_encoded() {
    let uri = file_uri(Path::new("/tmp/a b%41/größe"));
    assert_eq!(uri, "file:///tmp/a%20b%2541/gr%C3%B6%C3%9Fe");
    assert_eq!(file_uri(Path::new("/x-1_2.~/A9")), "file:///x-1_2.~/A9");
}
