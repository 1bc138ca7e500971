//! The page, served on the loopback address.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};

use crate::workshop::Workshop;

const PAGE: &str = "<!doctype html><title>Seaplant</title><p>from log to verdict";

/// A server that ends with the test.
struct Served {
    child: Child,
    port: String,
}

impl Served {
    fn start(workshop: &Workshop) -> Self {
        let mut child = Command::new(assert_cmd::cargo::cargo_bin!("seaplant"))
            .current_dir(workshop.path())
            .args(["page", ".", "--port", "0"])
            .stdout(Stdio::piped())
            .spawn()
            .expect("it starts");
        let mut line = String::new();
        let said = child.stdout.take().expect("standard output");
        BufReader::new(said).read_line(&mut line).expect("UTF-8");
        let port = line.split("127.0.0.1:").nth(1).expect("an address").split('/').next();
        let port = port.expect("a port").to_owned();
        Self { child, port }
    }

    fn answer(&self, request: &str, host: &str) -> String {
        let mut stream =
            TcpStream::connect(format!("127.0.0.1:{}", self.port)).expect("it listens");
        let words = format!("{request} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
        stream.write_all(words.as_bytes()).expect("it reads");
        let mut answer = String::new();
        stream.read_to_string(&mut answer).expect("UTF-8");
        answer
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.child.kill().expect("it runs until it is ended");
        self.child.wait().expect("it ended");
    }
}

#[test]
fn the_page_is_served_to_this_machine_and_nothing_else_is() {
    let workshop = Workshop::quick();
    workshop.write("index.html", PAGE);
    let served = Served::start(&workshop);
    let local = format!("127.0.0.1:{}", served.port);
    for path in ["/", "/index.html", "/?theme=dark"] {
        let answer = served.answer(&format!("GET {path}"), &local);
        assert!(answer.starts_with("HTTP/1.1 200") && answer.ends_with(PAGE), "{path}: {answer}");
        assert!(answer.contains("text/html; charset=utf-8"), "{answer}");
    }
    for path in ["/campaign.toml", "/../campaign.toml", "/log.csv"] {
        let answer = served.answer(&format!("GET {path}"), &local);
        assert!(answer.starts_with("HTTP/1.1 404"), "{path}: {answer}");
    }
    assert!(served.answer("POST /", &local).starts_with("HTTP/1.1 405"));
    // A foreign host name that resolves to this machine.
    let strange = format!("example.com:{}", served.port);
    assert!(served.answer("GET /", &strange).starts_with("HTTP/1.1 403"));
}

#[test]
fn a_folder_without_the_page_is_refused_with_what_to_do() {
    let workshop = Workshop::quick();
    let said = workshop.failure(&["page", "."]);
    assert!(said.contains("index.html cannot be read; make the page by scripts/page"), "{said}");
    workshop.write("index.html", "<p>another");
    let said = workshop.failure(&["page", "index.html"]);
    assert!(said.contains("index.html is not the page"), "{said}");
}
