//! A video of a run's page: Chromium draws its frames, ffmpeg makes the film.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use anyhow::{Context, Result, ensure};
use base64ct::{Base64, Encoding};
use files::temporary;

use crate::progress;

/// Settings of a video.
pub struct Film {
    /// Run time per video time.
    pub speed: f64,
    /// Frames a second.
    pub rate: u32,
    /// Length of the run, s.
    pub duration: f64,
}

/// Names under which Chromium is installed.
const BROWSERS: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];

/// Most frames, two minutes at 30 a second: the browser hands them over together.
const MOST_FRAMES: f64 = 3600.0;

/// Size of the picture, px.
const SIZE: [u32; 2] = [1280, 720];

/// Films a page to `out`, .mp4; complete or not at all.
///
/// # Errors
/// If the film would be too long, or Chromium or ffmpeg is missing or fails.
pub fn film(page: &str, film: &Film, out: &Path) -> Result<()> {
    let frames = (film.duration / film.speed * f64::from(film.rate)).ceil() + 1.0;
    ensure!(
        frames <= MOST_FRAMES,
        "--video: {frames} frames (allowed: {MOST_FRAMES}): play faster by --speed, or show a part by --from and --to"
    );
    let is_there = |program: &str| {
        let quiet = Command::new(program)
            .arg("-version")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        quiet.is_ok()
    };
    let browser = BROWSERS.into_iter().find(|name| is_there(name));
    let (Some(browser), true) = (browser, is_there("ffmpeg")) else {
        anyhow::bail!(
            "--video needs Chromium ({}) and ffmpeg on PATH; Debian: apt-get install chromium ffmpeg",
            BROWSERS.join(", ")
        );
    };
    let folder = temporary::Folder::new()?;
    let html = folder.path().join("page.html");
    std::fs::write(&html, page).context("the page cannot be written")?;
    let ending = out.extension().unwrap_or_default().to_string_lossy().into_owned();
    let draft = folder.path().join(format!("film.{ending}"));
    let mut drawn = draw(browser, &html, film, folder.path())?;
    let mut made = encode(film.rate, &draft)?;
    let bar = progress::of_frames()?;
    bar.set_length(frames as u64);
    let mut found = 0u64;
    {
        let mut into = made.stdin.take().context("ffmpeg takes no frames")?;
        // a frame a line, in Base64, between two lines that say where they begin and end
        for line in BufReader::new(drawn.stdout.take().context("the browser says nothing")?).lines()
        {
            let line = line.context("the browser's frames cannot be read")?;
            if let Some(frame) = line.strip_prefix("frame ") {
                let frame = Base64::decode_vec(frame.trim()).ok().context("a frame is damaged")?;
                if into.write_all(&frame).is_err() {
                    break; // ffmpeg says why
                }
                found += 1;
                bar.inc(1);
            }
        }
    }
    bar.finish_and_clear();
    drawn.wait().with_context(|| format!("{browser} was lost"))?;
    let made = made.wait_with_output().context("ffmpeg was lost")?;
    ensure!(
        made.status.success(),
        "ffmpeg failed: {}",
        String::from_utf8_lossy(&made.stderr).trim()
    );
    ensure!(found == frames as u64, "{browser} drew {found} of {frames} frames: has it no WebGL?");
    let bytes = std::fs::read(&draft).context("the film cannot be read")?;
    files::output::write(out, &bytes)
}

/// Starts a browser that draws the frames of a page; its output has them, a line each.
fn draw(browser: &str, html: &Path, film: &Film, folder: &Path) -> Result<Child> {
    let [width, height] = SIZE;
    let mut drawn = Command::new(browser);
    drawn.args([
        "--headless=new",
        "--hide-scrollbars",
        "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader",
    ]);
    #[cfg(unix)] // Chromium refuses to have root in its sandbox; the page is this program's own
    if std::fs::metadata("/proc/self").is_ok_and(|m| std::os::unix::fs::MetadataExt::uid(&m) == 0) {
        drawn.arg("--no-sandbox");
    }
    drawn
        .arg(format!("--user-data-dir={}", folder.join("profile").display()))
        .arg(format!("--window-size={width},{height}"))
        .arg("--dump-dom")
        .arg(format!(
            "file://{}#video={},{},{width},{height}",
            html.display(),
            film.rate,
            film.speed
        ));
    drawn
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .with_context(|| format!("{browser} cannot be started"))
}

/// Starts ffmpeg, which makes a film of the frames that it is given.
fn encode(rate: u32, draft: &Path) -> Result<Child> {
    Command::new("ffmpeg")
        .args(["-y", "-loglevel", "error", "-f", "image2pipe", "-c:v", "mjpeg", "-framerate"])
        .arg(rate.to_string())
        .args([
            "-i",
            "-",
            "-c:v",
            "libx264",
            "-crf",
            "20",
            "-pix_fmt",
            "yuv420p",
            "-movflags",
            "+faststart",
        ])
        .arg(draft)
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .context("ffmpeg cannot be started")
}
