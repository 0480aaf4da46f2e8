//! Prescribed rotation of the hub: angle, speed and acceleration over time.

use std::f64::consts::PI;

use crate::error::{Error, Result};

/// A function of time from outside.
pub trait Prescribed: Send + Sync {
    /// Angle (rad), speed (rad/s) and acceleration (rad/s^2) at a time.
    ///
    /// # Errors
    /// What the function reports.
    fn at(&self, t: f64) -> Result<[f64; 3]>;
}

/// `omega = speed/duration (t - duration/(2 pi) sin(2 pi t/duration))`, then `speed`; 0 before 0.
#[derive(Clone, Copy, Debug)]
pub struct SpinUp {
    /// Final speed, rad/s.
    pub speed: f64,
    /// Duration, s.
    pub duration: f64,
}

impl Prescribed for SpinUp {
    fn at(&self, t: f64) -> Result<[f64; 3]> {
        let SpinUp { speed, duration } = *self;
        Ok(if t <= 0.0 {
            [0.0; 3]
        } else if t >= duration {
            [speed * (t - 0.5 * duration), speed, 0.0]
        } else {
            let (sin, cos) = libm::sincos(2.0 * PI * t / duration);
            let rate = speed / duration;
            let wave = duration / (2.0 * PI);
            [
                rate * (0.5 * t * t + wave * wave * (cos - 1.0)),
                rate * (t - wave * sin),
                rate * (1.0 - cos),
            ]
        })
    }
}

/// Speeds at times, linear between and constant outside; the angle is 0 at the first time.
#[derive(Clone, Debug)]
pub struct Table {
    times: Vec<f64>,
    speeds: Vec<f64>,
    angles: Vec<f64>,
}

impl Table {
    /// # Errors
    /// [`Error::Argument`] for sizes that do not match or times that do not ascend.
    pub fn new(times: Vec<f64>, speeds: Vec<f64>) -> Result<Table> {
        if times.is_empty() || times.len() != speeds.len() {
            return Err(Error::argument("rotation: as many speeds as times are needed"));
        }
        if let Some(k) = times
            .windows(2)
            .position(|pair| pair[0].partial_cmp(&pair[1]) != Some(std::cmp::Ordering::Less))
        {
            return Err(Error::argument(format!(
                "rotation: times must ascend; entry {} does not exceed entry {k}",
                k + 1
            )));
        }
        let mut angles = vec![0.0];
        for k in 1..times.len() {
            let area = 0.5 * (speeds[k] + speeds[k - 1]) * (times[k] - times[k - 1]);
            angles.push(angles[k - 1] + area);
        }
        Ok(Table { times, speeds, angles })
    }
}

impl Prescribed for Table {
    fn at(&self, t: f64) -> Result<[f64; 3]> {
        let Table { times, speeds, angles } = self;
        let after = times.partition_point(|time| *time <= t);
        if after == 0 {
            return Ok([speeds[0] * (t - times[0]), speeds[0], 0.0]);
        }
        let k = after - 1;
        let since = t - times[k];
        let rate = match times.get(after) {
            Some(next) => (speeds[after] - speeds[k]) / (next - times[k]),
            None => 0.0,
        };
        Ok([angles[k] + since * (speeds[k] + 0.5 * rate * since), speeds[k] + rate * since, rate])
    }
}
