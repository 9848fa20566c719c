//! A pair of streams with threads of their own, so that nobody who shades waits without end.

use std::io::{self, BufRead, BufReader, Read, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread;
use std::time::Duration;

use crate::external::protocol::{Answer, MAX_LINE, parse};

/// Answers that may wait to be looked at; beyond it the peer waits.
const ANSWERS: usize = 1024;
/// Messages that may wait to be sent. One is on its way at a time.
const MESSAGES: usize = 2;

/// The near ends. The threads end when these are dropped and the streams end.
#[derive(Debug)]
pub(super) struct Link {
    requests: SyncSender<Vec<u8>>,
    answers: Receiver<Result<Answer, String>>,
}

impl Link {
    pub(super) fn new(mut to: Box<dyn Write + Send>, from: Box<dyn Read + Send>) -> io::Result<Self> {
        let (requests, outgoing) = sync_channel::<Vec<u8>>(MESSAGES);
        let (incoming, answers) = sync_channel(ANSWERS);
        thread::Builder::new()
            .name("shader-requests".into())
            .spawn(move || {
                for message in outgoing {
                    // A peer that no longer reads is found out by its silence.
                    if to.write_all(&message).and_then(|()| to.flush()).is_err() {
                        return;
                    }
                }
            })?;
        thread::Builder::new()
            .name("shader-answers".into())
            .spawn(move || listen(BufReader::new(from), &incoming))?;
        Ok(Self { requests, answers })
    }

    pub(super) fn send(&self, text: Vec<u8>) -> Result<(), String> {
        self.requests.try_send(text).map_err(|error| match error {
            TrySendError::Full(_) => "does not read what it is sent".to_owned(),
            TrySendError::Disconnected(_) => "has closed its input".to_owned(),
        })
    }

    /// The next answer; `None` if there is none within `timeout`.
    pub(super) fn receive(&self, timeout: Duration) -> Result<Option<Answer>, String> {
        match self.answers.recv_timeout(timeout) {
            Ok(answer) => answer.map(Some),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err("has ended".to_owned()),
        }
    }
}

/// Reads lines of bounded length until the stream ends, one is wrong, or nobody listens any more.
fn listen(mut from: impl BufRead, answers: &SyncSender<Result<Answer, String>>) {
    let mut line = Vec::with_capacity(MAX_LINE + 1);
    loop {
        line.clear();
        let read = from
            .by_ref()
            .take(MAX_LINE as u64 + 1)
            .read_until(b'\n', &mut line);
        let answer = match read {
            Ok(0) => return,
            Err(error) => Err(format!("its answers cannot be read: {error}")),
            Ok(_) if line.last() != Some(&b'\n') && line.len() > MAX_LINE => {
                Err(format!("sent a line of more than {MAX_LINE} bytes"))
            }
            Ok(_) if line.last() != Some(&b'\n') => Err("ended in the middle of a line".to_owned()),
            Ok(_) => match parse(&line) {
                Ok(None) => continue,
                Ok(Some(answer)) => Ok(answer),
                Err(error) => Err(error),
            },
        };
        let last = answer.is_err();
        if answers.send(answer).is_err() || last {
            return;
        }
    }
}
