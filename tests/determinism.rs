//! The same bytes whatever the threads, and whatever ran before.

use isospline_tests::Sandbox;

fn artifacts(threads: &str) -> Vec<(String, Vec<u8>)> {
    let sandbox = Sandbox::new();
    sandbox.converts("double_torus", &["--threads", threads, "--set", "target.faces=800"]);
    sandbox.artifacts()
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let one = artifacts("1");
    assert_eq!(one.len(), 10, "{:?}", one.iter().map(|a| &a.0).collect::<Vec<_>>());
    for threads in ["2", "3", "8"] {
        let many = artifacts(threads);
        for ((name, bytes), (other_name, other)) in one.iter().zip(&many) {
            assert_eq!(name, other_name);
            assert!(bytes == other, "{name} differs with {threads} threads");
        }
        assert_eq!(one.len(), many.len());
    }
}

#[test]
fn a_detour_over_other_parameters_gives_the_same_bytes() {
    let sandbox = Sandbox::new();
    let faces = ["--set", "target.faces=800"];
    sandbox.converts("torus", &faces);
    let before = sandbox.artifacts();
    sandbox.converts("torus", &[&faces[..], &["--set", "network.samples=24"]].concat());
    assert!(sandbox.artifacts() != before, "the parameter has no effect");
    sandbox.converts("torus", &faces);
    assert!(sandbox.artifacts() == before, "the way back gives other bytes");
}
