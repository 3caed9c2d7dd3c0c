//! `serve` on the command line: what it says, and what it refuses. `tests/remote` and `tests/window/elsewhere.rs` connect to it.

use std::process::Command;

fn serve(args: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pointillist"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).arg("serve").args(args);
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{args:?}");
    String::from_utf8_lossy(&output.stderr).replace("\n  │ ", " ")
}

#[test]
fn what_cannot_be_served_is_an_error() {
    let scene = "scenes/cornell.xml";
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = taken.local_addr().unwrap().to_string();
    for (args, wanted) in [
        (&[scene, "--listen", "0.0.0.0:0"][..], "can be reached from other machines: give --token-file"),
        (&[scene, "--listen", "7070"], "7070 is no address"),
        (&[scene, "--listen", &taken], "cannot listen on"),
        (&[scene, "--listen", "127.0.0.1:0", "--token-file", "no.such"], "cannot read no.such"),
        (&["no.such.xml", "--listen", "127.0.0.1:0"], "no.such.xml"),
    ] {
        let said = serve(args);
        assert!(said.contains(wanted) && !said.contains("panicked"), "{args:?}: {said}");
    }
}
