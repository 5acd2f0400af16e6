//! One row: files, a command, and what must come of it.

use std::io::Read;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Longer than any of these takes on a busy machine.
const SECONDS: u64 = 30;

/// What the command may allocate on top of its files, in KiB, and for each byte of them.
const MEMORY: u64 = 64 << 10;
const MEMORY_PER_BYTE: u64 = 16;

/// An input of the command and the one answer that is right.
pub struct Row {
    /// What is wrong with it.
    pub what: String,
    files: Vec<(String, Content)>,
    args: Vec<String>,
    variables: Vec<(&'static str, String)>,
    /// Lines of the shell that starts the command.
    shell: &'static str,
    /// Whether the command needs a device, and with it more memory than its files explain.
    device: bool,
    /// Exit codes of which one is right, and what the line must hold where that is not 0.
    codes: Vec<i32>,
    says: Vec<String>,
}

enum Content {
    Bytes(Vec<u8>),
    Link(String),
    Folder,
    /// A file of this length without content.
    Hole(u64),
    Pipe,
}

impl Row {
    /// `args` separated by spaces; refused with 2 unless told otherwise, and without a driver.
    pub fn new(what: impl Into<String>, args: &str) -> Self {
        let args = args.split(' ').map(str::to_string).collect();
        let none = "/nonexistent/driver.json".to_string();
        let variables = vec![("VK_ICD_FILENAMES", none.clone()), ("VK_DRIVER_FILES", none)];
        Self { what: what.into(), files: vec![], args, variables, shell: "", device: false, codes: vec![2], says: vec![] }
    }

    fn with(mut self, name: &str, content: Content) -> Self {
        self.files.push((name.into(), content));
        self
    }

    pub fn file(self, name: &str, bytes: impl Into<Vec<u8>>) -> Self {
        self.with(name, Content::Bytes(bytes.into()))
    }

    pub fn link(self, name: &str, target: &str) -> Self {
        self.with(name, Content::Link(target.into()))
    }

    pub fn folder(self, name: &str) -> Self {
        self.with(name, Content::Folder)
    }

    pub fn hole(self, name: &str, length: u64) -> Self {
        self.with(name, Content::Hole(length))
    }

    pub fn pipe(self, name: &str) -> Self {
        self.with(name, Content::Pipe)
    }

    /// What the line must hold.
    pub fn says(mut self, parts: &[&str]) -> Self {
        self.says.extend(parts.iter().map(|part| part.to_string()));
        self
    }

    /// As it should be: only the exit code counts.
    pub fn good(mut self, code: i32) -> Self {
        self.says.clear();
        self.codes(&[code])
    }

    pub fn codes(mut self, codes: &[i32]) -> Self {
        self.codes = codes.to_vec();
        self
    }

    /// On the test's own driver.
    pub fn on_a_device(mut self) -> Self {
        self.variables.clear();
        self.device = true;
        self
    }

    pub fn variable(mut self, name: &'static str, value: impl Into<String>) -> Self {
        self.variables.push((name, value.into()));
        self
    }

    pub fn shell(mut self, lines: &'static str) -> Self {
        self.shell = lines;
        self
    }

    /// Runs the command in `folder`, which is made for it and removed where all is well.
    ///
    /// The exit code, or what is wrong with the answer.
    pub fn run(&self, folder: &Path) -> Result<i32, String> {
        let size = self.write(folder);
        let before = names(folder);
        let memory = MEMORY + size * MEMORY_PER_BYTE / 1024;
        let limit = if self.device { String::new() } else { format!("ulimit -d {memory}\n") };
        let script = format!("{limit}{}\nexec \"$0\" \"$@\"", self.shell);
        let mut command = Command::new("sh");
        command.arg("-c").arg(script).arg(env!("CARGO_BIN_EXE_passband")).args(&self.args).current_dir(folder);
        command.envs(self.variables.iter().map(|(name, value)| (name, value))).env("RAYON_NUM_THREADS", "2");
        let start = Instant::now();
        let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let Some(code) = wait(&mut child, start + Duration::from_secs(SECONDS)) else {
            return Err(format!("not finished after {SECONDS} s"));
        };
        let mut said = String::new();
        child.stderr.take().unwrap().read_to_string(&mut said).map_err(|e| format!("standard error: {e}"))?;
        let told = format!("exit code {code}, and {said:?}");
        if !self.codes.contains(&code) {
            return Err(format!("{told}, expected exit code {:?}", self.codes));
        }
        // The bytes that break a line or command a terminal.
        let plain =
            said.strip_suffix('\n').is_some_and(|line| line.starts_with("passband: ") && !line.contains(char::is_control));
        if code > 1 && !plain {
            return Err(format!("{told}, expected one plain line"));
        }
        if let Some(part) = self.says.iter().find(|part| (code == 2 || self.codes.len() == 1) && !said.contains(*part)) {
            return Err(format!("{told}, expected {part:?} in it"));
        }
        let after = names(folder);
        if code > 1 && after != before {
            return Err(format!("{told}, and left {after:?} of {before:?}"));
        }
        std::fs::remove_dir_all(folder).unwrap();
        Ok(code)
    }

    /// Writes the files; their bytes on disk.
    fn write(&self, folder: &Path) -> u64 {
        if folder.exists() {
            std::fs::remove_dir_all(folder).unwrap();
        }
        std::fs::create_dir_all(folder).unwrap();
        let mut size = 0;
        for (name, content) in &self.files {
            let path = folder.join(name);
            match content {
                Content::Bytes(bytes) => {
                    size += bytes.len() as u64;
                    std::fs::write(path, bytes).unwrap();
                }
                Content::Link(target) => symlink(target, path).unwrap(),
                Content::Folder => std::fs::create_dir(path).unwrap(),
                Content::Hole(length) => std::fs::File::create(path).unwrap().set_len(*length).unwrap(),
                Content::Pipe => assert!(Command::new("mkfifo").arg(path).status().unwrap().success()),
            }
        }
        size
    }
}

fn wait(child: &mut Child, until: Instant) -> Option<i32> {
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            // A signal has no code.
            return Some(status.code().unwrap_or(-1));
        }
        if Instant::now() > until {
            child.kill().unwrap();
            child.wait().unwrap();
            return None;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Everything in a folder, hidden files too.
fn names(folder: &Path) -> Vec<PathBuf> {
    let mut names: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    names.sort();
    names
}
