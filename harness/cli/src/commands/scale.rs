use anyhow::Result;
use clap::Subcommand;
use experiments::scaling::{self, Flight};
use formulas::similarity::Liquid;

use crate::terminal;

/// Computes size and acceleration of the flight tank that a bench represents, by equal Bond or Froude numbers.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  hubslosh scale thesis\n  \
    hubslosh scale bond --flight-radius 2.0425 --flight-density 1141 --flight-tension 0.0132\n  \
    hubslosh scale numbers --radius 0.3 --acceleration 1e-5 --velocity 0.01\n  \
    hubslosh scale rotation --alpha 2.21 --flight-alpha 0.005\n  \
    hubslosh scale froude --lambda 25 --density-ratio 1.14")]
pub struct ScaleArgs {
    /// Prints the results as JSON, in SI units.
    #[arg(long, global = true, display_order = 900)]
    json: bool,
    #[command(subcommand)]
    what: Scale,
}

#[derive(Subcommand)]
enum Scale {
    /// Prints Bond numbers, accelerations and tank sizes of section 7.2 of Rubaga's thesis, as printed in the thesis
    /// and as computed by this command.
    #[command(after_help = "Example:\n  hubslosh scale thesis")]
    Thesis,
    /// Computes the Bond number of a tank, and the flight tank with the same Bond number.
    #[command(
        after_help = "Example:\n  hubslosh scale bond --flight-radius 2.0425 --flight-density 1141 --flight-tension 0.0132"
    )]
    Bond {
        #[command(flatten)]
        bench: TankAtRest,
        /// Density of the liquid in flight, kg/m³ [default: the density on the bench].
        #[arg(long)]
        flight_density: Option<f64>,
        /// Surface tension of the liquid in flight, N/m [default: the surface tension on the bench].
        #[arg(long)]
        flight_tension: Option<f64>,
        /// Radius of the flight tank, m. The command then computes the acceleration in flight.
        #[arg(long, conflicts_with = "flight_acceleration")]
        flight_radius: Option<f64>,
        /// Acceleration in flight, m/s². The command then computes the radius of the flight tank.
        #[arg(long)]
        flight_acceleration: Option<f64>,
    },
    /// Computes Bond, Weber and Froude numbers of a moving liquid, and which force dominates.
    #[command(
        after_help = "Example:\n  hubslosh scale numbers --radius 0.3 --acceleration 1e-5 --velocity 0.01"
    )]
    Numbers {
        #[command(flatten)]
        tank: TankAtRest,
        /// Velocity of the liquid in the tank, m/s.
        #[arg(long)]
        velocity: f64,
    },
    /// Computes the Bond numbers of a rotating tank, and the flight tanks with the same Bond numbers.
    #[command(after_help = "Example:\n  hubslosh scale rotation --alpha 2.21 --flight-alpha 0.005")]
    Rotation {
        /// Density of the liquid, kg/m³.
        #[arg(long, default_value_t = scaling::ROUND_WATER.density)]
        density: f64,
        /// Surface tension, N/m.
        #[arg(long, default_value_t = scaling::ROUND_WATER.tension)]
        tension: f64,
        /// Radius of the bench's tank, m.
        #[arg(long, default_value_t = scaling::BENCH.0)]
        radius: f64,
        /// Distance of the tank from the axis, m.
        #[arg(long, default_value_t = scaling::BENCH.1)]
        arm: f64,
        /// Largest angular acceleration on the bench, rad/s².
        #[arg(long)]
        alpha: f64,
        /// Largest angular rate on the bench, rad/s.
        #[arg(long)]
        omega: Option<f64>,
        /// Angular acceleration in flight, rad/s².
        #[arg(long, default_value_t = 0.005)]
        flight_alpha: f64,
    },
    /// Computes the factors from a scale model to full size, for example for time, force and pressure, that follow
    /// from equal Froude numbers.
    #[command(after_help = "Example:\n  hubslosh scale froude --lambda 25 --density-ratio 1.14")]
    Froude {
        /// Scale factor: a length at full size divided by the same length of the model.
        #[arg(long)]
        lambda: f64,
        /// Density of the liquid at full size divided by the density of the liquid of the model.
        #[arg(long, default_value_t = 1.0)]
        density_ratio: f64,
        /// Acceleration at full size divided by the acceleration of the model.
        #[arg(long, default_value_t = 1.0)]
        gravity_ratio: f64,
    },
}

/// A tank under acceleration; by default the tank of the bench, filled with water.
#[derive(clap::Args)]
struct TankAtRest {
    /// Density of the liquid, kg/m³.
    #[arg(long, default_value_t = scaling::WATER.density)]
    density: f64,
    /// Surface tension, N/m.
    #[arg(long, default_value_t = scaling::WATER.tension)]
    tension: f64,
    /// Acceleration along the tank's axis, m/s².
    #[arg(long, default_value_t = 9.81)]
    acceleration: f64,
    /// Radius of the tank, m.
    #[arg(long, default_value_t = scaling::BENCH.0)]
    radius: f64,
}

impl ScaleArgs {
    pub fn run(self) -> Result<()> {
        let found = match self.what {
            Scale::Thesis => scaling::thesis_found(),
            Scale::Bond {
                bench: TankAtRest { density, tension, acceleration, radius },
                flight_density,
                flight_tension,
                flight_radius,
                flight_acceleration,
            } => {
                let bench = Liquid { density, tension };
                let liquid = Liquid {
                    density: flight_density.unwrap_or(density),
                    tension: flight_tension.unwrap_or(tension),
                };
                let flight = flight_radius
                    .map(Flight::Radius)
                    .or(flight_acceleration.map(Flight::Acceleration));
                scaling::bond(bench, (acceleration, radius), liquid, flight)?
            }
            Scale::Numbers { tank, velocity } => {
                let TankAtRest { density, tension, acceleration, radius } = tank;
                scaling::numbers(Liquid { density, tension }, (acceleration, radius), velocity)?
            }
            Scale::Rotation { density, tension, radius, arm, alpha, omega, flight_alpha } => {
                let liquid = Liquid { density, tension };
                scaling::rotation(liquid, (radius, arm), (alpha, omega), flight_alpha)?
            }
            Scale::Froude { lambda, density_ratio, gravity_ratio } => {
                scaling::froude(lambda, density_ratio, gravity_ratio)?
            }
        };
        match self.json {
            true => terminal::print_json(&found.json)?,
            false => print!("{}", found.text),
        }
        Ok(())
    }
}
