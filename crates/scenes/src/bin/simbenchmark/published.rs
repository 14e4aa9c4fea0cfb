//! Figures that SimBenchmark published for other engines, as errors of `Task::error`. Of rolling it gives one step
//! length; ODE is stuck there, for its friction pyramid holds what slides in truth.

use crate::task::Task;

/// Step lengths of the figures \[s\].
const STEPS: [f64; 4] = [1e-4, 1e-3, 1e-2, 1e-1];

/// Error of an engine at each step length; `None` where none is given.
type Figures = (&'static str, [Option<f64>; 4]);

fn of(task: Task) -> Vec<Figures> {
    let all = |name, x: [f64; 4]| (name, x.map(Some));
    let one = |name, x| (name, [None, Some(x), None, None]);
    match task {
        Task::RollingOblique => vec![one("RaiSim", 4.1e-7), one("ODE", 3.14497), one("Bullet", 3.85e-27)],
        Task::RollingAlong => Vec::new(),
        Task::Bouncing => vec![
            all("RaiSim", [1.9e-6, 0.0186, 186.0, 1.8e6]),
            all("ODE", [1.85, 185.0, 1.9e4, 2.0e6]),
            all("Bullet", [752.0, 7.5e4, 7.4e6, 7.7e8]),
        ],
        Task::Cube => vec![
            all("RaiSim", [1.64e-6, 1.35e-4, 0.0153, 0.962]),
            all("ODE", [1.59e-6, 1.57e-4, 0.0162, 3.06]),
            all("Bullet", [0.0035, 0.382, 37.0, 2.8e5]),
            all("MuJoCo", [0.0113, 0.095, 0.933, 11.0]),
        ],
        Task::ElasticCube => vec![
            all("RaiSim", [0.0011, 8.37, 5.2e6, 1.2e8]),
            all("ODE", [1.10, 112.0, 8.6e6, 1.9e7]),
            all("Bullet", [168.0, 4.1e4, 9.9e6, 1.7e9]),
        ],
    }
}

/// Engines and their errors on a task with steps of a length \[s\].
pub fn at(task: Task, dt: f64) -> Vec<(&'static str, f64)> {
    let Some(k) = STEPS.iter().position(|s| (s / dt - 1.0).abs() < 1e-9) else { return Vec::new() };
    of(task).into_iter().filter_map(|(name, errors)| Some((name, errors[k]?))).collect()
}
