//! Exports as the documentation promises them: whole or not there, and made as they are written.

#![cfg(unix)]

use isospline_tests::{PAPER_FIT, Sandbox};
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

/// All the memory of its own that an export may have; files come to more, and so do the patches.
const MEMORY_KB: u64 = 1536;

const FORMATS: [&str; 10] = ["step", "msh", "vtu", "bv", "npz", "glb", "obj", "ply", "stl", "3mf"];

const MESHES: [&str; 5] = ["glb", "obj", "ply", "stl", "3mf"];

#[test]
fn exports_take_little_memory_and_are_whole_or_not_there() {
    let sandbox = Sandbox::new();
    sandbox.converts("torus", &[&["--set", "target.faces=2000"], &PAPER_FIT[..]].concat());
    std::fs::create_dir(sandbox.path("files")).unwrap();
    memory_does_not_grow_with_the_file(&sandbox);
    a_killed_export_leaves_the_file_that_was_there(&sandbox);
    a_file_that_does_not_fit_leaves_the_one_that_was_there_and_no_draft(&sandbox);
}

/// Runs the program under a limit of the shell.
fn limited(sandbox: &Sandbox, limit: &str, args: &[&str]) -> Output {
    let program = sandbox.command(&[]).get_program().to_owned();
    let mut shell = Command::new("sh");
    shell.current_dir(sandbox.path("")).arg("-c").arg(format!("ulimit {limit}; exec \"$@\""));
    shell.arg("sh").arg(program).args(args).output().expect("sh starts")
}

/// The draft of the file that is being written, once there are some bytes in it.
fn draft_with_bytes(sandbox: &Sandbox) -> Option<PathBuf> {
    let entries = std::fs::read_dir(sandbox.path("files")).expect("the folder can be read");
    let mut drafts = entries.map(|entry| entry.expect("an entry").path());
    drafts.find(|path| {
        let is_draft =
            path.file_name().expect("a name").to_string_lossy().starts_with(".isospline-");
        is_draft && std::fs::metadata(path).is_ok_and(|data| data.len() > 0)
    })
}

fn memory_does_not_grow_with_the_file(sandbox: &Sandbox) {
    for format in FORMATS {
        let file = format!("files.{format}");
        let mut args = vec!["export", "out", "--format", format, "-o", &file];
        if MESHES.contains(&format) {
            args.extend(["--samples", "6"]);
        }
        let output = limited(sandbox, &format!("-d {MEMORY_KB}"), &args);
        assert!(output.status.success(), "{format}: {}", String::from_utf8_lossy(&output.stderr));
        let length = std::fs::metadata(sandbox.path(&file)).expect("the file is there").len();
        assert!(length > 1024 * MEMORY_KB, "{format}: {length} bytes prove nothing");
        std::fs::remove_file(sandbox.path(&file)).expect("the file goes");
    }
}

fn a_killed_export_leaves_the_file_that_was_there(sandbox: &Sandbox) {
    for format in ["step", "obj", "3mf"] {
        let file = format!("files/surface.{format}");
        let before = b"what was there before";
        sandbox.write(&file, before);
        let args = ["export", "out", "--format", format, "-o", &file];
        let mut child =
            sandbox.command(&args).stdout(Stdio::null()).spawn().expect("the program starts");
        let draft = loop {
            if let Some(draft) = draft_with_bytes(sandbox) {
                break draft;
            }
            assert!(
                child.try_wait().expect("a child").is_none(),
                "{format}: done before it was killed"
            );
        };
        child.kill().expect("a child");
        assert_eq!(
            child.wait().expect("a child").code(),
            None,
            "{format}: done before it was killed"
        );
        assert!(
            std::fs::read(sandbox.path(&file)).expect("the file is there") == before,
            "{format}"
        );
        std::fs::remove_file(draft).expect("the file goes");
        // And what is written next is whole.
        sandbox.succeeds(&args);
        assert!(
            std::fs::metadata(sandbox.path(&file)).expect("the file is there").len() > 100_000,
            "{format}"
        );
        std::fs::remove_file(sandbox.path(&file)).expect("the file goes");
    }
}

fn a_file_that_does_not_fit_leaves_the_one_that_was_there_and_no_draft(sandbox: &Sandbox) {
    sandbox.write("files/surface.step", "before");
    // In blocks of 512 bytes.
    let args = ["export", "out", "--format", "step", "-o", "files/surface.step"];
    let output = limited(sandbox, "-f 2000", &args);
    assert_eq!(output.status.code(), Some(33), "{}", String::from_utf8_lossy(&output.stderr));
    let entries = std::fs::read_dir(sandbox.path("files")).expect("the folder can be read");
    let names: Vec<_> = entries.map(|entry| entry.expect("an entry").file_name()).collect();
    assert_eq!(names, ["surface.step"]);
    assert_eq!(
        std::fs::read(sandbox.path("files/surface.step")).expect("the file is there"),
        b"before"
    );
}

#[test]
fn equal_surfaces_give_equal_files_whatever_the_threads() {
    let sandbox = Sandbox::new();
    let mut kept: Vec<Vec<u8>> = Vec::new();
    for threads in ["1", "2"] {
        let faces = ["--set", "target.faces=300", "--threads", threads];
        sandbox.converts("torus", &[&faces[..], &PAPER_FIT].concat());
        for (k, format) in FORMATS.into_iter().enumerate() {
            sandbox.succeeds(&[
                "export",
                "out",
                "--format",
                format,
                "-o",
                "surface",
                "--tolerance",
                "1e-3",
            ]);
            let bytes = std::fs::read(sandbox.path("surface")).expect("the file is there");
            match kept.get(k) {
                Some(first) => assert!(*first == bytes, "{format}"),
                None => kept.push(bytes),
            }
        }
        std::fs::remove_dir_all(sandbox.path("out")).unwrap();
    }
}
