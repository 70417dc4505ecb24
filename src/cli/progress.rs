//! How a running render tells about itself: bars, lines, JSON, or nothing.
//!
//! The renderer knows nothing of this. It counts in a [`RenderControl`]; a watcher thread reads the
//! counters a few times a second and draws.

use super::arguments::ProgressForm;
use super::failure::Failure;
use super::format;
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use kinora::extract::ChosenIntegrator;
use kinora::frame::{MethodListener, RenderControl};
use kinora::output::FrameEntry;
use serde_json::{Value, json};
use std::collections::HashSet;
use std::io::{self, IsTerminal, Write};
use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Tells the user how far the render is.
pub struct Progress {
    view: View,
    told: Told,
    done: usize,
    pending: usize,
    watcher: Option<Watcher>,
}

/// What was told already: it is not told again.
#[derive(Clone, Default)]
struct Told(Arc<Mutex<HashSet<String>>>);

impl Told {
    /// Whether this is new.
    fn add(&self, text: &str) -> bool {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(text.to_owned())
    }
}

/// Where and how it is told.
#[derive(Clone)]
enum View {
    Bars(Bars),
    Lines,
    Json(Events),
    None,
}

/// JSON on stdout, and the first error of writing it: the pictures are finished all the same.
#[derive(Clone, Default)]
struct Events(Arc<Mutex<Option<io::Error>>>);

/// One bar for the sequence, one for the frame.
#[derive(Clone)]
struct Bars {
    all: MultiProgress,
    sequence: ProgressBar,
    frame: ProgressBar,
}

/// Steps of the sequence bar per frame, so that it moves within a frame.
const STEPS: u64 = 1000;

impl Progress {
    pub fn new(form: ProgressForm, control: &RenderControl, pending: usize) -> Self {
        let view = match form {
            ProgressForm::None => View::None,
            ProgressForm::Json => View::Json(Events::default()),
            ProgressForm::Human if io::stderr().is_terminal() => View::Bars(Bars::new(pending)),
            ProgressForm::Human => View::Lines,
        };
        let watcher = match view {
            View::Bars(_) => Some((Duration::from_millis(100), view.clone())),
            View::Json(_) => Some((Duration::from_secs(1), view.clone())),
            View::Lines | View::None => None,
        };
        let watcher = watcher.map(|(every, view)| Watcher::start(every, view, control.clone()));
        Self { view, told: Told::default(), done: 0, pending, watcher }
    }

    /// What is about to happen: `text` for people, `facts` for programs.
    pub fn start(&self, text: &str, facts: Value) {
        match &self.view {
            View::Bars(bars) => bars.print(text),
            View::Lines => say(text),
            View::Json(events) => events.send("start", facts),
            View::None => {}
        }
    }

    pub fn frame_started(&self, frame: i32) {
        if let Some(watcher) = &self.watcher {
            watcher.shared.set(Watched::Frame { frame, index: self.done, since: Instant::now() });
        }
    }

    pub fn frame_done(&mut self, entry: &FrameEntry) {
        self.done += 1;
        if let Some(watcher) = &self.watcher {
            watcher.shared.set(Watched::Idle);
        }
        let seconds = entry.wall_seconds;
        match &self.view {
            View::Bars(bars) => bars.sequence.set_position(self.done as u64 * STEPS),
            View::Lines => say(&format!(
                "frame {} done ({} of {}): {}, {} rays/s -> {}",
                entry.frame,
                self.done,
                self.pending,
                format::duration(Duration::from_secs_f64(seconds)),
                format::count(entry.report.rays as f64 / seconds.max(f64::MIN_POSITIVE)),
                entry.files.join(", ")
            )),
            View::Json(events) => events.send(
                "frame",
                json!({
                    "frame": entry.frame, "done": self.done, "of": self.pending,
                    "seconds": seconds, "samples": entry.report.samples, "rays": entry.report.rays,
                    "files": entry.files, "fingerprint": entry.fingerprint,
                }),
            ),
            View::None => {}
        }
    }

    /// Something the user should know; the same words are told once.
    pub fn warn(&self, text: &str) {
        warn(&self.view, &self.told, text);
    }

    /// Tells which integrator runs and why, and what is out of its reach: before the first frame, and again
    /// where it changes.
    pub fn method_listener(&self) -> MethodListener {
        let (view, told) = (self.view.clone(), self.told.clone());
        MethodListener::new(move |chosen| {
            // The reason has numbers in it which change from frame to frame.
            if told.add(&format!("integrator {}", chosen.method.name())) {
                let text = format!("integrator: {}", method_in_words(chosen));
                match &view {
                    View::Bars(bars) => bars.print(&text),
                    View::Lines => say(&text),
                    View::Json(events) => events.send(
                        "integrator",
                        json!({ "name": chosen.method.name(), "reason": chosen.reason }),
                    ),
                    View::None => {}
                }
            }
            chosen.warnings.iter().for_each(|warning| warn(&view, &told, warning));
        })
    }

    /// The end: takes the bars away; `text` for people, `facts` for programs.
    ///
    /// An error says that events were lost on the way.
    pub fn end(mut self, text: &str, facts: Value) -> Result<(), Failure> {
        drop(self.watcher.take());
        if let View::Bars(bars) = &self.view {
            bars.frame.finish_and_clear();
            bars.sequence.finish_and_clear();
        }
        match &self.view {
            View::Bars(_) | View::Lines if !text.is_empty() => say(text),
            View::Json(events) => {
                events.send("end", facts);
                return events.lock().take().map_or(Ok(()), |error| Err(error.into()));
            }
            _ => {}
        }
        Ok(())
    }
}

/// `Path (Auto takes it: nothing casts caustics)`.
fn method_in_words(chosen: &ChosenIntegrator) -> String {
    match chosen.reason {
        None => format!("{} (as the settings say)", chosen.method.name()),
        Some(_) => chosen.description(),
    }
}

fn warn(view: &View, told: &Told, text: &str) {
    if !told.add(text) {
        return;
    }
    // Excerpts of a scene are labelled already.
    let label = if text.starts_with("warning") { "" } else { "warning: " };
    match view {
        View::Bars(bars) => bars.print(&format!("{label}{text}")),
        View::Lines => say(&format!("{label}{text}")),
        View::Json(events) => events.send("warning", json!({ "text": text })),
        View::None => {}
    }
}

/// Tells people something on stderr. It is lost quietly where nobody listens any more, and where `eprintln!` would
/// panic: the pictures and the exit code are what counts.
///
/// Names in it cannot do anything to a terminal.
pub fn say(text: &str) {
    say_as_it_is(&format::harmless_lines(text));
}

/// [`say`] for excerpts of a scene, which are harmless already and have colours.
pub fn say_as_it_is(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{text}");
}

impl Events {
    /// One object on one line, with `event` as its first field.
    fn send(&self, name: &str, facts: Value) {
        let mut line = serde_json::Map::from_iter([("event".to_owned(), Value::from(name))]);
        if let Value::Object(fields) = facts {
            line.extend(fields);
        }
        let mut out = io::stdout().lock();
        if let Err(error) = writeln!(out, "{}", Value::Object(line)).and_then(|()| out.flush()) {
            self.lock().get_or_insert(error);
        }
    }

    fn lock(&self) -> MutexGuard<'_, Option<io::Error>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Bars {
    fn new(pending: usize) -> Self {
        let style = |template: &str| {
            ProgressStyle::with_template(template)
                .expect("the template is a constant")
                .progress_chars("=> ")
        };
        let all = MultiProgress::with_draw_target(ProgressDrawTarget::stderr());
        let sequence = all.add(ProgressBar::new(pending as u64 * STEPS));
        let frame = all.add(ProgressBar::new(STEPS));
        sequence.set_style(style("{prefix:>12} [{bar:32}] {msg}"));
        frame.set_style(style("{prefix:>12} [{bar:32}] {msg}"));
        sequence.set_prefix("all frames");
        Self { all, sequence, frame }
    }

    fn print(&self, text: &str) {
        // A terminal that is gone is no reason to stop.
        let _ = self.all.println(format::harmless_lines(text));
    }

    fn draw(&self, watched: &Snapshot, since_start: Duration) {
        let share = watched.share();
        self.frame.set_prefix(format!("frame {}", watched.frame));
        self.frame.set_position((share * STEPS as f64) as u64);
        self.frame.set_message(format!(
            "{:3.0} %  {} rays/s, {} left",
            100.0 * share,
            format::count(watched.rays as f64 / watched.elapsed.as_secs_f64().max(0.001)),
            time_left(watched.elapsed, share)
        ));
        let steps = (watched.index as f64 + share) * STEPS as f64;
        self.sequence.set_position(steps as u64);
        let total = self.sequence.length().unwrap_or(STEPS).max(1) as f64;
        self.sequence.set_message(format!(
            "{} of {} done, {} left",
            watched.index,
            total as u64 / STEPS,
            time_left(since_start, steps / total)
        ));
    }
}

/// At the speed so far.
fn time_left(elapsed: Duration, share: f64) -> String {
    let seconds = elapsed.as_secs_f64() * (1.0 - share) / share;
    match Duration::try_from_secs_f64(seconds) {
        Ok(left) => format::duration(left),
        Err(_) => "?".to_owned(), // nothing done yet
    }
}

/// What the watcher looks at.
enum Watched {
    Idle,
    Frame { frame: i32, index: usize, since: Instant },
    End,
}

/// The counters at one moment.
struct Snapshot {
    frame: i32,
    index: usize,
    elapsed: Duration,
    samples_done: u64,
    samples_total: u64,
    rays: u64,
}

impl Snapshot {
    fn share(&self) -> f64 {
        (self.samples_done as f64 / self.samples_total.max(1) as f64).min(1.0)
    }
}

struct Shared {
    watched: Mutex<Watched>,
    changed: Condvar,
}

impl Shared {
    fn set(&self, watched: Watched) {
        *self.lock() = watched;
        self.changed.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, Watched> {
        self.watched.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The thread that reads the counters; it ends when this is dropped.
struct Watcher {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Watcher {
    fn start(every: Duration, view: View, control: RenderControl) -> Self {
        let shared =
            Arc::new(Shared { watched: Mutex::new(Watched::Idle), changed: Condvar::new() });
        let thread = std::thread::spawn({
            let shared = shared.clone();
            move || watch(&shared, every, &view, &control)
        });
        Self { shared, thread: Some(thread) }
    }
}

impl Drop for Watcher {
    fn drop(&mut self) {
        self.shared.set(Watched::End);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join(); // if drawing panicked, the render is none the worse for it
        }
    }
}

fn watch(shared: &Shared, every: Duration, view: &View, control: &RenderControl) {
    let start = Instant::now();
    let mut next = start + every;
    let mut watched = shared.lock();
    loop {
        if matches!(*watched, Watched::End) {
            return;
        }
        let now = Instant::now();
        if now < next {
            let wait = shared.changed.wait_timeout(watched, next - now);
            watched = wait.unwrap_or_else(PoisonError::into_inner).0;
            continue;
        }
        next = now + every;
        if let Watched::Frame { frame, index, since } = *watched {
            let snapshot = Snapshot {
                frame,
                index,
                elapsed: since.elapsed(),
                samples_done: control.samples_done.load(Relaxed),
                samples_total: control.samples_total.load(Relaxed),
                rays: control.rays.load(Relaxed),
            };
            show(view, &snapshot, start.elapsed());
        }
    }
}

fn show(view: &View, snapshot: &Snapshot, since_start: Duration) {
    match view {
        View::Bars(bars) => bars.draw(snapshot, since_start),
        View::Json(events) => events.send(
            "progress",
            json!({
                "frame": snapshot.frame, "seconds": snapshot.elapsed.as_secs_f64(),
                "samples_done": snapshot.samples_done, "samples_total": snapshot.samples_total,
                "rays": snapshot.rays,
            }),
        ),
        View::Lines | View::None => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_left_follows_from_the_share_done() {
        assert_eq!(time_left(Duration::from_secs(10), 0.25), "30.0 s");
        assert_eq!(time_left(Duration::from_secs(10), 1.0), "0.00 s");
        assert_eq!(time_left(Duration::from_secs(10), 0.0), "?");
    }

    #[test]
    fn the_watcher_ends_at_once_when_it_is_dropped() {
        let start = Instant::now();
        let watcher = Watcher::start(Duration::from_hours(1), View::None, RenderControl::default());
        watcher.shared.set(Watched::Frame { frame: 1, index: 0, since: Instant::now() });
        drop(watcher);
        assert!(start.elapsed() < Duration::from_secs(10));
    }
}
