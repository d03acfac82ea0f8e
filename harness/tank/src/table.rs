//! Writes modal parameters as a table for readers.

use crate::coefficients::FiniteAmplitude;
use crate::modal::{Axis, Capillarity, Damping, ModalData, Mode, Rest, Spin};

/// Formats a length in m to 1e-9 m without trailing zeros, because a fill that was computed from a
/// volume has 17 digits.
pub(crate) fn format_length(length: f64) -> String {
    format!("{length:.9}").trim_end_matches('0').trim_end_matches('.').to_string()
}

pub(crate) fn significant(value: f64) -> String {
    let rounded: f64 = format!("{value:.6e}").parse().unwrap_or(value);
    if rounded == 0.0 { "0".into() } else { rounded.to_string() }
}

/// Returns the modal data as a table for the terminal: liquid, modes, rigid liquid, and error. The
/// frequencies hold at the specific force `gravity`, m/s², unless the data have frequencies with
/// surface tension.
pub fn table(data: &ModalData, gravity: f64) -> String {
    let mut text = Text::default();
    let (name, fill, rho) =
        (data.name.as_deref().unwrap_or("tank"), format_length(data.fill), data.rho);
    text.line(format!("{name}: fill {fill} m, density {rho} kg/m³"));
    text.line(format!("  heights               {}", data.origin()));
    if data.modes.is_empty() {
        text.line("  free surface          none: the tank is full and does not slosh");
    } else if let (Some(outer), Some(inner)) = (data.r_surface, data.r_inner) {
        let hole = if inner > 0.0 { format!(", inner radius {inner:.6} m") } else { "".into() };
        text.line(format!("  free surface          radius {outer:.6} m{hole}"));
    }
    let ModalData { m_liq, z_cg, .. } = data;
    text.line(format!("  liquid                {m_liq:.6} kg, centre of mass at z = {z_cg:.6} m"));
    text.inertia("about the axis, rigid", data.i_frozen_axis);
    if let Some(inertia) = data.i_eff_axis {
        text.inertia("about the axis, effective", inertia);
    }
    if let Some(axes) = &data.axes {
        for (name, axis, along_y) in [("x", &axes.x, false), ("y", &axes.y, true)] {
            let Axis { i_frozen_cg, i_eff_cg, modes, rest } = axis;
            text.line(format!("\nmotion along {name}"));
            let f = data.frequencies(gravity, along_y);
            text.modes([*i_frozen_cg, *i_eff_cg], modes, rest, gravity, &f);
        }
    } else {
        let inertias = [data.i_frozen_cg, data.i_eff_cg];
        let f = data.frequencies(gravity, false);
        text.modes(inertias, &data.modes, &data.rest, gravity, &f);
    }
    if let Some(capillarity) = data.capillarity.as_ref().filter(|_| !data.modes.is_empty()) {
        text.capillarity(capillarity);
    } else if gravity == 0.0 && !data.modes.is_empty() {
        text.line("\nat 0 m/s² only capillarity brings the liquid back, which is not in this table without --sigma: f is 0");
    }
    if let Some(found) = &data.finite_amplitude {
        let waves = [data.modes.first(), data.axes.as_ref().and_then(|axes| axes.y.modes.first())];
        text.amplitude(found, waves.map(|mode| mode.map_or(0.0, |mode| mode.wave)));
    }
    if let Some(damping) = &data.damping {
        text.damping(damping);
    }
    if let Some(spin) = &data.spin {
        text.spin(spin);
    }
    let ModalData { error, error_i_0, error_beta, .. } = data;
    text.line(format!(
        "\nestimated error {error:.0e}, of I_0 {error_i_0:.0e}, of beta {error_beta:.0e} (relative to the result, the liquid's mass, R)"
    ));
    text.0
}

#[derive(Default)]
struct Text(String);

impl Text {
    fn line(&mut self, line: impl AsRef<str>) {
        self.0 += line.as_ref();
        self.0 += "\n";
    }

    fn warnings(&mut self, beginning: &str, warnings: &[String]) {
        warnings.iter().for_each(|warning| self.line(format!("  {beginning}{warning}")));
    }

    fn inertia(&mut self, what: &str, inertia: f64) {
        self.line(format!("  inertia {what:30} {} kg·m²", significant(inertia)));
    }

    fn spin(&mut self, spin: &Spin) {
        let [omega, gravity] = [spin.omega, spin.gravity].map(significant);
        self.line(format!(
            "\nturning with the tank at {omega} rad/s under {gravity} m/s² along the axis"
        ));
        let apex = match spin.z_apex {
            Some(apex) => format!("z = {apex:.6} m on the axis, "),
            None if spin.r_dry > 0.0 => format!("floor dry within {:.6} m, ", spin.r_dry),
            None => String::new(),
        };
        let wall = spin.z_wall;
        self.line(format!("  surface               {apex}outer wall wet up to z = {wall:.6} m"));
        self.line(format!("  centre of mass        z = {:.6} m", spin.z_cg));
        self.inertia("about the axis", spin.i_axis);
        self.inertia("across it, about the centre", spin.i_cg);
        let number = |value: Option<f64>| value.map_or("-".into(), |value| format!("{value:.3}"));
        let [flatness, ratio] = [spin.flatness, spin.ratio].map(number);
        self.line(format!("  Omega^2 R/g = {flatness}, 2 Omega/omega of mode 1 = {ratio}"));
        if let Some([against, along]) = spin.frequencies {
            self.line(format!(
                "  mode 1 seen from the tank: {against:.4} Hz against the spin, {along:.4} Hz with it"
            ));
        }
        self.warnings("warning: ", &spin.warnings);
    }

    fn capillarity(&mut self, capillarity: &Capillarity) {
        let Capillarity { contact_angle, bond, warnings, .. } = capillarity;
        let sigma = significant(capillarity.sigma);
        let bond = bond.map_or("".into(), |bond| format!(", Bond number {}", significant(bond)));
        self.line(format!(
            "\nf is with surface tension {sigma} N/m, contact angle {contact_angle} degrees{bond}"
        ));
        self.warnings("warning: ", warnings);
    }

    fn amplitude(&mut self, found: &FiniteAmplitude, waves: [f64; 2]) {
        self.line("\nfinite amplitude of mode 1 at the slosh angle A, rad");
        let axes = if found.mode_y.is_some() { ["x", "y"] } else { ["", ""] };
        if let (None, Some(limit)) = (&found.mode, found.pendulum_limit) {
            self.line(format!("  pendulum in range up to {:.1} degrees", limit.to_degrees()));
        }
        for ((mode, axis), wave) in [&found.mode, &found.mode_y].into_iter().zip(axes).zip(waves) {
            let Some(known) = mode else { continue };
            let along = if axis.is_empty() { "".into() } else { format!("motion along {axis}: ") };
            let source = match known.bridged {
                true => "interpolated across a secondary resonance".to_string(),
                false => format!("error {:.0e} of the series", known.error),
            };
            let (s, kappa) = (known.nonlinear_inertia, known.nonlinear_stiffness);
            self.line(format!("  {along}s = {s:.4}, kappa = {kappa:.4}, {source}"));
            let frequency = known.frequency_limit.map_or(String::new(), |limit| {
                let limit = limit.to_degrees();
                format!(
                    "frequency within 0.3 % up to {limit:.1} degrees, a forced response within 3 % "
                )
            });
            let rotary = |limit: Option<f64>| {
                limit.map_or(String::new(), |limit| {
                    format!(", rotary motion up to {:.1} degrees", limit.to_degrees())
                })
            };
            let swirl = rotary(known.swirl_limit);
            let (limit, from) = (known.angle_limit.to_degrees(), known.angle_limit_from.describe());
            self.line(format!("  in range: {frequency}up to {limit:.1} degrees{swirl} ({from})"));
            if let Some(energy) = &known.energy {
                let [s, kappa, s_2, kappa_2, t, t_2] = energy.parameters().map(|(_, value)| value);
                let limit = energy.angle_limit.to_degrees();
                self.line(format!(
                    "  with the wave's energy, for SloshTank and Spacecraft: s = {s:.4}, kappa = {kappa:.4}, s_2 = {s_2:.4}, \
                     kappa_2 = {kappa_2:.4}, t = {t:.4}, t_2 = {t_2:.4}, in range up to {limit:.1} degrees{}",
                    rotary(energy.swirl_limit)
                ));
            }
            let circular =
                known.circular.map_or("".into(), |shift| format!(", circular {shift:+.4} A^2"));
            let (planar, second) = (known.planar, known.wave_second);
            self.line(format!(
                "  omega^2 shifts by the part {planar:+.4} A^2 in planar motion{circular} (pendulum: -0.125 A^2, +0.5 A^2)"
            ));
            self.line(format!(
                "  wave at the wall, m: crest {wave:.6} A {second:+.6} A^2, trough {wave:.6} A {:+.6} A^2",
                -second
            ));
        }
        self.warnings("warning: ", &found.warnings);
    }

    fn damping(&mut self, damping: &Damping) {
        let (gravity, nu, taken) = (damping.gravity, significant(damping.nu), &damping.taken);
        self.line(format!("\ndamping at {gravity} m/s², nu {nu} m2/s: {taken}"));
        for (along, modes) in [("", &damping.modes), (" along y", &damping.modes_y)] {
            if modes.is_empty() {
                continue;
            }
            self.line(format!(
                "\n  n{along:9}     f          zeta     expected between       laminar layer"
            ));
            self.line("                Hz");
            for (n, mode) in (1..).zip(modes) {
                let (f, [low, high]) = (mode.omega / core::f64::consts::TAU, mode.interval);
                let (zeta, laminar) = (mode.zeta, mode.laminar);
                self.line(format!(
                    " {n:2}  {f:17.6}  {zeta:12.4e} {low:10.2e} {high:10.2e} {laminar:15.4e}"
                ));
            }
        }
        self.warnings("", &damping.warnings);
    }

    fn modes(
        &mut self,
        [rigid, effective]: [f64; 2],
        modes: &[Mode],
        rest: &[Rest],
        gravity: f64,
        frequencies: &[Option<f64>],
    ) {
        self.inertia("about the centre, rigid", rigid);
        self.inertia("about the centre, effective", effective);
        if modes.is_empty() {
            return;
        }
        self.line(format!(
            "\n  n  f at {gravity} m/s²    lambda        m         m/m_liq    length       bob at      hinge at    wave        beta"
        ));
        self.line("         Hz           1/m           kg                   m            z, m        z, m        m/rad       1/m");
        for (mode, f) in modes.iter().zip(frequencies) {
            let Mode { n, lambda, m, m_ratio, l, height, hinge, wave, beta, .. } = mode;
            let number = |z: Option<f64>| z.map_or("-".to_string(), |z| format!("{z:.6}"));
            let [f, bob, hinge] = [*f, *height, *hinge].map(number);
            self.line(format!(
                " {n:2}  {f:>12} {lambda:12.6} {m:12.6} {m_ratio:10.6} {l:11.6} {bob:>11} {hinge:>11} {wave:11.6} {beta:11.5}"
            ));
        }
        self.line("\n  fixed mass after       m_0, kg     H_0, m      I_0, kg·m²");
        for Rest { modes, m_0, height, inertia } in rest {
            let word = if *modes == 1 { "mode " } else { "modes" };
            self.line(format!(
                "   {modes:3} {word}         {m_0:12.6} {height:11.6} {inertia:14.6e}"
            ));
        }
    }
}
