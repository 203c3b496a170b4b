//! A headless Chromium, driven by its debugging protocol.

use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tungstenite::{Message, WebSocket};

/// Running browser, which all tests of a program share as long as one of them has a page.
struct Process {
    child: Child,
    /// Address of the web socket that commands go to.
    url: String,
    _profile: tempfile::TempDir,
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Process {
    /// The running browser, or the installed one, started; `None` if there is none.
    fn shared() -> Option<Arc<Self>> {
        static SHARED: Mutex<Weak<Process>> = Mutex::new(Weak::new());
        let mut shared = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(running) = shared.upgrade() {
            return Some(running);
        }
        let started = Arc::new(Self::start()?);
        *shared = Arc::downgrade(&started);
        Some(started)
    }

    fn start() -> Option<Self> {
        let names = ["chromium", "chromium-browser", "google-chrome"];
        let folders = std::env::var_os("PATH")?;
        let program = std::env::split_paths(&folders)
            .flat_map(|folder| names.map(|name| folder.join(name)))
            .find(|p| p.is_file())?;
        let profile = tempfile::tempdir().expect("a folder");
        let mut child = Command::new(program)
            .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"])
            .args(["--disable-background-networking", "--disable-component-update", "--disable-sync"])
            // pages of several tests are drawn at the same time, as if each were in front
            .args(["--disable-backgrounding-occluded-windows", "--disable-renderer-backgrounding"])
            .args(["--disable-background-timer-throttling", "--remote-debugging-port=0", "about:blank"])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the browser starts");
        let mut lines = BufReader::new(child.stderr.take().expect("a pipe")).lines();
        let url = lines
            .by_ref()
            .map_while(Result::ok)
            .find_map(|l| Some(l.split_once("DevTools listening on ")?.1.trim().to_string()))
            .expect("the browser listens");
        // further output is read, so that it does not fill the pipe
        std::thread::spawn(move || lines.for_each(drop));
        Some(Self { child, url, _profile: profile })
    }
}

/// Browser with one page, whose storage and downloads are its own.
pub(crate) struct Browser {
    socket: WebSocket<TcpStream>,
    session: Option<String>,
    /// Identifier of its storage.
    pub(crate) context: Value,
    next: u64,
    /// Events of the page: console messages, exceptions, requests.
    pub(crate) events: Vec<Value>,
    _process: Arc<Process>,
}

impl Drop for Browser {
    fn drop(&mut self) {
        // closes the page
        let request = json!({ "id": 0, "method": "Target.disposeBrowserContext",
            "params": { "browserContextId": self.context } });
        let _ = self.socket.send(Message::text(request.to_string()));
        let _ = self.socket.close(None);
        let _ = self.socket.flush();
    }
}

impl Browser {
    /// Opens an empty page in the installed browser; `None` if there is none.
    pub(crate) fn start() -> Option<Self> {
        let process = Process::shared()?;
        let address = process.url.strip_prefix("ws://").and_then(|u| u.split('/').next());
        let stream = TcpStream::connect(address.expect("an address")).expect("a connection");
        stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a time limit");
        let (socket, _) = tungstenite::client(process.url.as_str(), stream).expect("a web socket");
        let mut out = Self {
            socket,
            session: None,
            context: json!(""),
            next: 0,
            events: Vec::new(),
            _process: process,
        };
        out.context = out.call("Target.createBrowserContext", json!({}))["browserContextId"].clone();
        let target = out.call(
            "Target.createTarget",
            json!({ "url": "about:blank", "browserContextId": out.context, "newWindow": true }),
        );
        let attached =
            out.call("Target.attachToTarget", json!({ "targetId": target["targetId"], "flatten": true }));
        out.session = attached["sessionId"].as_str().map(Into::into);
        for domain in ["Page", "Runtime", "Log", "Network"] {
            out.call(&format!("{domain}.enable"), json!({}));
        }
        out.call("Emulation.setFocusEmulationEnabled", json!({ "enabled": true }));
        Some(out)
    }

    /// Sends one command and returns its answer.
    pub(crate) fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.next += 1;
        let id = self.next;
        let mut request = json!({ "id": id, "method": method, "params": parameters });
        if let Some(session) = &self.session {
            request["sessionId"] = json!(session);
        }
        self.socket.send(Message::text(request.to_string())).expect("sent");
        loop {
            let message = self.read();
            if message["id"] == json!(id) {
                assert!(message["error"].is_null(), "{method}: {}", message["error"]);
                return message["result"].clone();
            }
            self.events.push(message);
        }
    }

    fn read(&mut self) -> Value {
        loop {
            if let Message::Text(text) = self.socket.read().expect("an answer") {
                return serde_json::from_str(text.as_str()).expect("JSON");
            }
        }
    }

    /// Value of an expression in the page.
    pub(crate) fn value(&mut self, expression: &str) -> Value {
        let parameters = json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let answer = self.call("Runtime.evaluate", parameters);
        assert!(answer["exceptionDetails"].is_null(), "{expression}: {}", answer["exceptionDetails"]);
        answer["result"]["value"].clone()
    }

    /// Opens a file in a window of this size (pixels) and waits until it is drawn.
    pub(crate) fn open(&mut self, file: &Path, width: u32, height: u32) {
        self.size(width, height);
        self.call("Page.navigate", json!({ "url": format!("file://{}", file.display()) }));
        let patience = Instant::now() + Duration::from_secs(60);
        while self.value("document.readyState") != json!("complete") {
            assert!(Instant::now() < patience, "the page does not load");
            std::thread::sleep(Duration::from_millis(20));
        }
        self.settle();
    }

    /// Waits for two frames.
    pub(crate) fn settle(&mut self) {
        self.value("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done(1))))");
    }

    /// Changes the size of the window (pixels).
    pub(crate) fn size(&mut self, width: u32, height: u32) {
        let size = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        self.call("Emulation.setDeviceMetricsOverride", size);
    }

    /// Moves the mouse to the middle of an element, and clicks it if `click`.
    pub(crate) fn mouse(&mut self, selector: &str, click: bool) {
        let look = format!(
            "(() => {{ const e = document.querySelector({selector:?}); e.scrollIntoView({{block: 'center'}}); \
             const r = e.getBoundingClientRect(), x = r.left + r.width / 2, y = r.top + r.height / 2; \
             return [x, y, e.contains(document.elementFromPoint(x, y))]; }})()"
        );
        // late answers move what is below them: the place is taken once it stays, with nothing above it
        let mut place = self.value(&look);
        for _ in 0..40 {
            self.settle();
            let before = std::mem::replace(&mut place, self.value(&look));
            if before == place && place[2] == json!(true) {
                break;
            }
        }
        let mut event = |kind: &str, button: &str| {
            let at = json!({ "type": kind, "x": place[0], "y": place[1], "button": button, "clickCount": 1 });
            self.call("Input.dispatchMouseEvent", at);
        };
        event("mouseMoved", "none");
        if click {
            event("mousePressed", "left");
            event("mouseReleased", "left");
        }
        self.settle();
    }
}
