//! Who is measured, and how: in turn on the same few rays, so that all see the same weather.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use pointillist::tracer::accel::Ray;

use crate::common::thread_seconds;

/// A way to answer the two questions.
pub trait Contestant: Sync {
    /// Name, as in the tables.
    fn name(&self) -> &'static str;
    /// Bytes of tree and triangles.
    fn bytes(&self) -> usize;
    /// Called before rays that this one is to answer.
    fn prepare(&self) {}
    /// Distance of the nearest hit of each ray; infinite for none.
    fn closest(&self, rays: &[Ray], found: &mut [f32]);
    /// Zero for each ray that hits anything, infinity for others.
    fn occluded(&self, rays: &[Ray], found: &mut [f32]);
}

/// The two questions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Question {
    /// What is hit first.
    Closest,
    /// Whether anything is hit.
    Occluded,
}

impl Question {
    /// Name, as in the tables.
    pub fn name(self) -> &'static str {
        match self {
            Question::Closest => "closest",
            Question::Occluded => "occluded",
        }
    }

    /// Asks it.
    pub fn ask(self, of: &dyn Contestant, rays: &[Ray], found: &mut [f32]) {
        match self {
            Question::Closest => of.closest(rays, found),
            Question::Occluded => of.occluded(rays, found),
        }
    }
}

/// How much is measured.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Rounds at most, and at least.
    pub rounds: (usize, usize),
    /// Each round takes one of so many chunks, another one each.
    pub part: usize,
    /// Seconds after which no further round starts.
    pub seconds: f64,
}

/// Rays that are asked together before it is the next one's turn; a few hundredths of a second.
const CHUNK: usize = 1 << 15;

/// Rays that a thread takes at a time.
const PIECE: usize = 1 << 11;

/// Seconds per ray: of each round, of each contestant.
pub fn contest(
    contestants: &[Box<dyn Contestant>],
    question: Question,
    rays: &[Ray],
    threads: usize,
    effort: Effort,
) -> Vec<Vec<f64>> {
    let mut found = vec![0.0; CHUNK];
    let start = Instant::now();
    let (mut rounds, mut turns) = (Vec::new(), 0);
    while rounds.len() < effort.rounds.0
        && (rounds.len() < effort.rounds.1 || start.elapsed().as_secs_f64() < effort.seconds)
    {
        let mut seconds = vec![0.0; contestants.len()];
        let mut count = 0;
        for chunk in rays.chunks(CHUNK).skip(rounds.len() % effort.part).step_by(effort.part) {
            count += chunk.len();
            // Another one begins each time: the first finds the rays out of the cache.
            for turn in 0..contestants.len() {
                let who = (turns + turn) % contestants.len();
                seconds[who] += ask(&*contestants[who], question, chunk, &mut found[..chunk.len()], threads);
            }
            turns += 1;
        }
        rounds.push(seconds.into_iter().map(|s| s / count as f64).collect());
    }
    rounds
}

/// Seconds for the answers to all rays: of one thread those it ran, so that other programs cost nothing; of several those
/// on the wall.
fn ask(of: &dyn Contestant, question: Question, rays: &[Ray], found: &mut [f32], threads: usize) -> f64 {
    of.prepare();
    if threads == 1 {
        let start = thread_seconds();
        question.ask(of, rays, found);
        return thread_seconds() - start;
    }
    let pieces: Vec<_> = rays.chunks(PIECE).zip(found.chunks_mut(PIECE)).map(Mutex::new).collect();
    let next = AtomicUsize::new(0);
    let start = Instant::now();
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let Some(piece) = pieces.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let mut piece = piece.lock().unwrap();
                    let (rays, found) = &mut *piece;
                    question.ask(of, rays, found);
                }
            });
        }
    });
    start.elapsed().as_secs_f64()
}
