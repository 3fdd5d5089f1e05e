//! Pages as a browser sees them.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::skips::skipped;

/// Nothing from elsewhere, tags that close in order, at most 1 MB.
pub fn assert_self_contained(html: &str) {
    assert!(html.len() <= 1_000_000, "{} bytes", html.len());
    let elsewhere =
        ["http://", "https://", "src=", "<link", "@import", "url(", "<iframe", "<object", "fetch(", "XMLHttp"];
    for foreign in elsewhere {
        assert!(!html.contains(foreign), "the page holds `{foreign}`");
    }
    let html = without_scripts(html);
    assert!(!html.contains("NaN"), "a number that is none");
    assert_nested(&html);
}

fn without_scripts(html: &str) -> String {
    let mut parts = html.split("<script");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |page, part| page + part.split_once("</script>").expect("a script ends").1)
}

fn assert_nested(html: &str) {
    let mut open: Vec<&str> = Vec::new();
    for (index, _) in html.match_indices('<') {
        let Some(tag) = html[index + 1..].split('>').next() else { panic!("a tag without an end") };
        let name = tag.trim_start_matches('/').split([' ', '\n', '/']).next().unwrap_or_default();
        match tag {
            _ if tag.starts_with('!') || tag.ends_with('/') || ["meta", "br"].contains(&name) => {}
            _ if tag.starts_with('/') => {
                assert_eq!(open.pop(), Some(name), "…{}", &html[index.saturating_sub(80)..index])
            }
            _ => open.push(name),
        }
    }
    assert!(open.is_empty(), "not closed: {open:?}");
}

/// A picture of a page.
pub struct Picture {
    grey: Vec<f64>,
}

impl Picture {
    /// Mean of the pixels, 0 black to 255 white.
    pub fn brightness(&self) -> f64 {
        self.grey.iter().sum::<f64>() / self.grey.len() as f64
    }

    /// Root mean square about the mean.
    pub fn contrast(&self) -> f64 {
        let mean = self.brightness();
        (self.grey.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / self.grey.len() as f64).sqrt()
    }
}

fn chromium() -> Option<PathBuf> {
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let folders = std::env::var_os("PATH").unwrap_or_default();
    let found = std::env::split_paths(&folders).flat_map(|f| names.map(|n| f.join(n))).find(|p| p.is_file());
    if found.is_none() {
        skipped("pages in a browser", &format!("none of {} is on the PATH", names.join(", ")));
    }
    found
}

fn headless(browser: &Path, profile: &Path) -> Command {
    let mut command = Command::new(browser);
    command
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
            "--disable-dev-shm-usage",
        ])
        .args(["--disable-background-networking", "--disable-component-update", "--disable-sync", "--hide-scrollbars"])
        .arg(format!("--user-data-dir={}", profile.display()));
    command
}

/// What a page has asked of the network, by Chromium's log of it; the browser's own requests are of no page.
fn requests(log: &Path) -> Vec<String> {
    let log = std::fs::read_to_string(log).expect("the log of the network");
    assert!(log.contains("\"constants\""), "the log of the network is of another form");
    let of_page = log.lines().filter(|line| line.contains("\"network_isolation_key\":\"file:"));
    let url = |line: &str| line.split("\"url\":\"").nth(1)?.split('"').next().map(str::to_owned);
    of_page.filter_map(url).collect()
}

/// The page's elements after a script of the test has run at its end, in headless Chromium; fails on a message in its console and on a request to the network. None where there is no Chromium.
pub fn after_script(page: &Path, script: &str) -> Option<String> {
    let browser = chromium()?;
    let folder = tempfile::tempdir().unwrap();
    let [scripted, log] = ["page.html", "network.json"].map(|name| folder.path().join(name));
    let html = std::fs::read_to_string(page).unwrap();
    std::fs::write(&scripted, html.replace("</body>", &format!("<script>{script}</script></body>"))).unwrap();
    let output = headless(&browser, folder.path())
        .args(["--enable-logging=stderr", "--window-size=1100,2000", "--dump-dom"])
        .arg(format!("--log-net-log={}", log.display()))
        .arg(format!("file://{}", scripted.display()))
        .output()
        .unwrap();
    let messages = String::from_utf8_lossy(&output.stderr);
    let console: Vec<&str> = messages.lines().filter(|line| line.contains("CONSOLE")).collect();
    assert!(output.status.success() && console.is_empty(), "{console:?}");
    assert_eq!(requests(&log), [""; 0], "the page asks for something of the network");
    Some(String::from_utf8(output.stdout).unwrap())
}

/// Moves the pointer over every figure, zooms into it and back, and writes down which figures did not answer.
const VISITOR: &str = r#"
const told = { figures: 0, silent: [], fixed: [] };
const places = [];
for (let x = 0.15; x < 0.96; x += 0.1) for (const y of [0.5, 0.3, 0.7]) places.push([x, y]);
for (const svg of document.querySelectorAll("svg.live")) {
  const name = svg.getAttribute("aria-label");
  const move = (kind, x, y, more) => {
    const box = svg.getBoundingClientRect();
    svg.dispatchEvent(new PointerEvent(kind, { clientX: box.left + x * box.width, clientY: box.top + y * box.height, bubbles: true, ...more }));
  };
  const numbers = () => [...svg.querySelectorAll("text.number")].map(text => text.textContent).join(" ");
  const values = svg.closest("figure").querySelector(".values");
  told.figures += 1;
  if (!places.some(([x, y]) => { move("pointermove", x, y); return /\d/.test(values.textContent); })) told.silent.push(name);
  const before = numbers();
  move("pointerdown", 0.4, 0.3, { button: 0 });
  move("pointermove", 0.6, 0.6);
  move("pointerup", 0.6, 0.6);
  if (numbers() === before) told.fixed.push(name);
  svg.dispatchEvent(new KeyboardEvent("keydown", { key: "0", bubbles: true }));
  if (numbers() !== before) told.fixed.push(name);
}
document.title = JSON.stringify(told);
"#;

/// What a script has left as the title of a page.
pub fn told(dom: &str) -> serde_json::Value {
    let title = dom.split("<title>").nth(1).and_then(|rest| rest.split("</title>").next()).expect("a title");
    serde_json::from_str(&title.replace("&amp;", "&")).expect(title)
}

/// A page that holds all it needs; in headless Chromium, where that is there, it also asks for nothing of the network, says nothing in its console, and its figures answer pointer and keys.
pub fn assert_works(page: &Path) {
    assert_self_contained(&std::fs::read_to_string(page).unwrap());
    let Some(dom) = after_script(page, VISITOR) else { return };
    let told = told(&dom);
    assert!(told["figures"].as_u64().unwrap() > 0, "{told}");
    for fault in ["silent", "fixed"] {
        assert!(told[fault].as_array().unwrap().is_empty(), "{}: {told}", page.display());
    }
}

/// A page that is seen on a light and on a dark screen, in headless Chromium where that is there.
pub fn assert_light_and_dark(page: &Path) {
    let (Some(light), Some(dark)) = (screenshot(page, false), screenshot(page, true)) else { return };
    assert!(light.brightness() > 200.0 && dark.brightness() < 60.0, "{} {}", light.brightness(), dark.brightness());
    // Ink on both: neither a blank page nor ink of the paper's colour.
    assert!(light.contrast() > 10.0 && dark.contrast() > 10.0, "{} {}", light.contrast(), dark.contrast());
}

/// The page in headless Chromium; says so and returns none where there is no Chromium.
pub fn screenshot(page: &Path, dark: bool) -> Option<Picture> {
    let browser = chromium()?;
    let profile = tempfile::tempdir().unwrap();
    let picture: PathBuf = profile.path().join("page.png");
    // Blink's setting counts from dark.
    let scheme = if dark { 0 } else { 1 };
    let output = headless(&browser, profile.path())
        .arg(format!("--blink-settings=preferredColorScheme={scheme}"))
        .arg("--window-size=1100,5200")
        .arg(format!("--screenshot={}", picture.display()))
        .arg(format!("file://{}", page.canonicalize().unwrap().display()))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    if let Some(folder) = std::env::var_os("GMHM_SCREENSHOTS") {
        let name =
            format!("{}-{}.png", page.file_stem().unwrap().to_string_lossy(), if dark { "dark" } else { "light" });
        std::fs::copy(&picture, Path::new(&folder).join(name)).unwrap();
    }
    let mut reader =
        png::Decoder::new(std::io::BufReader::new(std::fs::File::open(&picture).unwrap())).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    let grey = bytes[..info.buffer_size()].chunks_exact(info.color_type.samples());
    Some(Picture { grey: grey.map(|p| p[..3].iter().map(|c| f64::from(*c)).sum::<f64>() / 3.0).collect() })
}
