use std::net::{IpAddr, Ipv4Addr};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, anyhow, bail};
use serde_json::json;
use tiny_http::{Header, Method, Request, Response, Server};

use crate::args::Page;
use crate::output::{FAINT, Output, STRONG};

/// Serves the page on the loopback address until Ctrl-C ends the program.
pub fn run(arguments: &Page, output: Output) -> Result<ExitCode> {
    let file = match &arguments.page {
        Some(path) if path.is_dir() => path.join(INDEX),
        Some(path) => path.clone(),
        None => beside_the_program()?,
    };
    let page = read(&file)?;
    let server = Server::http((IpAddr::from(Ipv4Addr::LOCALHOST), arguments.port))
        .map_err(|error| anyhow!("{error}"))
        .with_context(|| {
            let port = arguments.port;
            format!("cannot listen on port {port} of 127.0.0.1; name another by --port, or 0 for any free one")
        })?;
    let Some(address) = server.server_addr().to_ip() else { bail!("the server has no address") };
    let url = format!("http://{address}/");
    output.give(&json!({ "url": url, "page": file }), || {
        format!(
            "the page is at {STRONG}{url}{STRONG:#}, for this machine only\n{FAINT}Ctrl-C ends it{FAINT:#}"
        )
    })?;
    for request in server.incoming_requests() {
        // A browser that disconnects early is no error of this program.
        let _ = answer(request, &page, address.port());
    }
    Ok(ExitCode::SUCCESS)
}

const INDEX: &str = "index.html";

/// Text by which the page is recognised.
const MARK: &[u8] = b"Seaplant";

fn beside_the_program() -> Result<PathBuf> {
    let program = std::env::current_exe().context("the place of the program is not known")?;
    Ok(program.with_file_name("page").join(INDEX))
}

fn read(file: &Path) -> Result<Vec<u8>> {
    let shown = file.display();
    let page = std::fs::read(file).with_context(|| {
        format!("{shown} cannot be read; make the page by scripts/page FOLDER in the source, and name that folder: seaplant page FOLDER")
    })?;
    if !page.windows(MARK.len()).any(|words| words == MARK) {
        bail!(
            "{shown} is not the page; name the folder, or the index.html, that scripts/page made"
        );
    }
    Ok(page)
}

/// Answers a request for the page; refuses any other, and one under another host's name that
/// resolves to this machine.
fn answer(request: Request, page: &[u8], port: u16) -> std::io::Result<()> {
    let is_get = matches!(request.method(), Method::Get | Method::Head);
    let path = request.url().split(['?', '#']).next().unwrap_or_default();
    let is_page = path == "/" || path.strip_prefix('/') == Some(INDEX);
    if !is_local(&request, port) {
        return refuse(request, 403, "this page is for 127.0.0.1 only\n");
    }
    if !is_get {
        return refuse(request, 405, "this page can be read only\n");
    }
    if !is_page {
        return refuse(request, 404, "there is one page here: /\n");
    }
    let mut response = Response::from_data(page);
    for (name, value) in [
        ("Content-Type", "text/html; charset=utf-8"),
        ("X-Content-Type-Options", "nosniff"),
        ("Referrer-Policy", "no-referrer"),
        ("Cache-Control", "no-cache"),
    ] {
        response.add_header(header(name, value)?);
    }
    request.respond(response)
}

fn refuse(request: Request, status: u16, words: &str) -> std::io::Result<()> {
    request.respond(Response::from_string(words).with_status_code(status))
}

/// Returns true if the request names the loopback address.
fn is_local(request: &Request, port: u16) -> bool {
    let host = request.headers().iter().find(|header| header.field.equiv("Host"));
    let known = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{port}"));
    host.is_some_and(|host| known.iter().any(|known| host.value.as_str() == known))
}

fn header(name: &str, value: &str) -> std::io::Result<Header> {
    Header::from_bytes(name, value).map_err(|()| std::io::Error::other(format!("header {name}")))
}
