//! Writes modal parameters as a table for readers.

use core::fmt::Write as _;

use crate::coefficients::FiniteAmplitude;
use crate::modal::{Axis, Capillarity, Damping, ModalData, Mode, Rest, Spin};

/// Formats a length in m to 1e-9 m without trailing zeros, because fills from a volume have 17 digits.
pub(crate) fn short(length: f64) -> String {
    format!("{length:.9}").trim_end_matches('0').trim_end_matches('.').to_string()
}

pub(crate) fn significant(value: f64) -> String {
    let rounded: f64 = format!("{value:.6e}").parse().unwrap_or(value);
    if rounded == 0.0 { "0".into() } else { rounded.to_string() }
}

/// Returns the result as text: liquid, modes, rigid liquid, and the error. `gravity`, m/s², gives the
/// frequencies if the result has none with surface tension.
pub fn table(data: &ModalData, gravity: f64) -> String {
    let mut text = String::new();
    let name = data.name.as_deref().unwrap_or("tank");
    let _ = writeln!(text, "{name}: fill {} m, density {} kg/m³", short(data.fill), data.rho);
    let _ = writeln!(text, "  heights               {}", data.origin());
    if data.modes.is_empty() {
        let _ = writeln!(text, "  free surface          none: the tank is full and does not slosh");
    } else if let (Some(outer), Some(inner)) = (data.r_surface, data.r_inner) {
        let _ = write!(text, "  free surface          radius {outer:.6} m");
        let _ = writeln!(
            text,
            "{}",
            if inner > 0.0 { format!(", inner radius {inner:.6} m") } else { String::new() }
        );
    }
    let _ = writeln!(
        text,
        "  liquid                {:.6} kg, centre of mass at z = {:.6} m",
        data.m_liq, data.z_cg
    );
    let rigid = significant(data.i_frozen_axis);
    let _ = writeln!(text, "  inertia about the axis, rigid          {rigid} kg·m²");
    if let Some(inertia) = data.i_eff_axis {
        let inertia = significant(inertia);
        let _ = writeln!(text, "  inertia about the axis, effective      {inertia} kg·m²");
    }
    if let Some(axes) = &data.axes {
        for (name, axis, along_y) in [("x", &axes.x, false), ("y", &axes.y, true)] {
            let Axis { i_frozen_cg, i_eff_cg, modes, rest } = axis;
            let _ = writeln!(text, "\nmotion along {name}");
            let f = data.frequencies(gravity, along_y);
            section(&mut text, [*i_frozen_cg, *i_eff_cg], modes, rest, gravity, &f);
        }
    } else {
        let inertias = [data.i_frozen_cg, data.i_eff_cg];
        let f = data.frequencies(gravity, false);
        section(&mut text, inertias, &data.modes, &data.rest, gravity, &f);
    }
    if let Some(capillarity) = data.capillarity.as_ref().filter(|_| !data.modes.is_empty()) {
        capillarity_section(&mut text, capillarity);
    } else if gravity == 0.0 && !data.modes.is_empty() {
        let _ = writeln!(
            text,
            "\nat 0 m/s² only capillarity brings the liquid back, which is not in this table without --sigma: f is 0"
        );
    }
    if let Some(found) = &data.finite_amplitude {
        let waves = [data.modes.first(), data.axes.as_ref().and_then(|axes| axes.y.modes.first())];
        amplitude_section(&mut text, found, waves.map(|mode| mode.map_or(0.0, |mode| mode.wave)));
    }
    if let Some(damping) = &data.damping {
        damping_section(&mut text, damping);
    }
    if let Some(spin) = &data.spin {
        spin_section(&mut text, spin);
    }
    let _ = writeln!(
        text,
        "\nestimated error {:.0e}, of I_0 {:.0e}, of beta {:.0e} (relative to the result, the liquid's mass, R)",
        data.error, data.error_i_0, data.error_beta
    );
    text
}

fn spin_section(text: &mut String, spin: &Spin) {
    let _ = writeln!(
        text,
        "\nturning with the tank at {} rad/s under {} m/s² along the axis",
        significant(spin.omega),
        significant(spin.gravity)
    );
    let apex = match spin.z_apex {
        Some(apex) => format!("z = {apex:.6} m on the axis, "),
        None if spin.r_dry > 0.0 => format!("floor dry within {:.6} m, ", spin.r_dry),
        None => String::new(),
    };
    let _ = writeln!(
        text,
        "  surface               {apex}outer wall wet up to z = {:.6} m",
        spin.z_wall
    );
    let _ = writeln!(text, "  centre of mass        z = {:.6} m", spin.z_cg);
    let _ = writeln!(
        text,
        "  inertia about the axis                 {} kg·m²",
        significant(spin.i_axis)
    );
    let _ =
        writeln!(text, "  inertia across it, about the centre    {} kg·m²", significant(spin.i_cg));
    let number = |value: Option<f64>| value.map_or("-".to_string(), |value| format!("{value:.3}"));
    let _ = writeln!(
        text,
        "  Omega^2 R/g = {}, 2 Omega/omega of mode 1 = {}",
        number(spin.flatness),
        number(spin.ratio)
    );
    if let Some([against, along]) = spin.frequencies {
        let _ = writeln!(
            text,
            "  mode 1 seen from the tank: {against:.4} Hz against the spin, {along:.4} Hz with it"
        );
    }
    for warning in &spin.warnings {
        let _ = writeln!(text, "  warning: {warning}");
    }
}

fn capillarity_section(text: &mut String, capillarity: &Capillarity) {
    let Capillarity { sigma, contact_angle, bond, warnings, .. } = capillarity;
    let bond = bond.map_or(String::new(), |bond| format!(", Bond number {}", significant(bond)));
    let _ = writeln!(
        text,
        "\nf is with surface tension {} N/m, contact angle {contact_angle} degrees{bond}",
        significant(*sigma)
    );
    for warning in warnings {
        let _ = writeln!(text, "  warning: {warning}");
    }
}

fn amplitude_section(text: &mut String, found: &FiniteAmplitude, waves: [f64; 2]) {
    let _ = writeln!(text, "\nfinite amplitude of mode 1 at the slosh angle A, rad");
    let axes = if found.mode_y.is_some() { ["x", "y"] } else { ["", ""] };
    for ((mode, axis), wave) in [&found.mode, &found.mode_y].into_iter().zip(axes).zip(waves) {
        let Some(known) = mode else { continue };
        let along = if axis.is_empty() { String::new() } else { format!("motion along {axis}: ") };
        let circular =
            known.circular.map_or(String::new(), |shift| format!(", circular {shift:+.4} A^2"));
        let _ = writeln!(
            text,
            "  {along}s = {:.4}, kappa = {:.4}, {}",
            known.nonlinear_inertia,
            known.nonlinear_stiffness,
            match known.bridged {
                true => "bridged across a secondary resonance".to_string(),
                false => format!("error {:.0e} of the series", known.error),
            }
        );
        let frequency = known.frequency_limit.map_or(String::new(), |limit| {
            format!(
                "frequency within 0.3 % up to {:.1} degrees, a forced response within 3 % ",
                limit.to_degrees()
            )
        });
        let swirl = known.swirl_limit.map_or(String::new(), |limit| {
            format!(", rotary motion up to {:.1} degrees", limit.to_degrees())
        });
        let _ = writeln!(
            text,
            "  in range: {frequency}up to {:.1} degrees{swirl} ({})",
            known.angle_limit.to_degrees(),
            known.angle_limit_from.words()
        );
        if let Some(energy) = &known.energy {
            let _ = writeln!(
                text,
                "  with the wave's energy, for SloshTank and Spacecraft: s = {:.4}, kappa = {:.4}, s_2 = {:.4}, kappa_2 = {:.4}, t = {:.4}, \
                 t_2 = {:.4}, in range up to {:.1} degrees",
                energy.nonlinear_inertia,
                energy.nonlinear_stiffness,
                energy.nonlinear_inertia_2,
                energy.nonlinear_stiffness_2,
                energy.rotary_inertia,
                energy.rotary_inertia_2,
                energy.angle_limit.to_degrees()
            );
        }
        let _ = writeln!(
            text,
            "  omega^2 shifts by the part {:+.4} A^2 in planar motion{circular} (pendulum: -0.125 A^2, +0.5 A^2)",
            known.planar
        );
        let _ = writeln!(
            text,
            "  wave at the wall, m: crest {wave:.6} A {:+.6} A^2, trough {wave:.6} A {:+.6} A^2",
            known.wave_second, -known.wave_second
        );
    }
    for warning in &found.warnings {
        let _ = writeln!(text, "  warning: {warning}");
    }
}

fn damping_section(text: &mut String, damping: &Damping) {
    let _ = writeln!(
        text,
        "\ndamping at {} m/s², nu {} m2/s: {}",
        damping.gravity,
        significant(damping.nu),
        damping.taken
    );
    for (along, modes) in [("", &damping.modes), (" along y", &damping.modes_y)] {
        if modes.is_empty() {
            continue;
        }
        let _ = writeln!(
            text,
            "\n  n{along:9}     f          zeta     expected between       laminar layer"
        );
        let _ = writeln!(text, "                Hz");
        for (n, mode) in modes.iter().enumerate() {
            let [low, high] = mode.interval;
            let f = mode.omega / core::f64::consts::TAU;
            let _ = writeln!(
                text,
                " {:2}  {f:17.6}  {:12.4e} {low:10.2e} {high:10.2e} {:15.4e}",
                n + 1,
                mode.zeta,
                mode.laminar
            );
        }
    }
    for warning in &damping.warnings {
        let _ = writeln!(text, "  {warning}");
    }
}

fn section(
    text: &mut String,
    [rigid, effective]: [f64; 2],
    modes: &[Mode],
    rest: &[Rest],
    gravity: f64,
    frequencies: &[Option<f64>],
) {
    let (rigid, effective) = (significant(rigid), significant(effective));
    let _ = writeln!(text, "  inertia about the centre, rigid        {rigid} kg·m²");
    let _ = writeln!(text, "  inertia about the centre, effective    {effective} kg·m²");
    if modes.is_empty() {
        return;
    }
    let _ = writeln!(
        text,
        "\n  n  f at {gravity} m/s²    lambda        m         m/m_liq    length       bob at      hinge at    wave        beta"
    );
    let _ = writeln!(
        text,
        "         Hz           1/m           kg                   m            z, m        z, m        m/rad       1/m"
    );
    for (m, f) in modes.iter().zip(frequencies) {
        let height = |z: Option<f64>| z.map_or("-".to_string(), |z| format!("{z:.6}"));
        let _ = writeln!(
            text,
            " {:2}  {:>12} {:12.6} {:12.6} {:10.6} {:11.6} {:>11} {:>11} {:11.6} {:11.5}",
            m.n,
            f.map_or("-".to_string(), |f| format!("{f:.6}")),
            m.lambda,
            m.m,
            m.m_ratio,
            m.l,
            height(m.height),
            height(m.hinge),
            m.wave,
            m.beta
        );
    }
    let _ = writeln!(text, "\n  fixed mass after       m_0, kg     H_0, m      I_0, kg·m²");
    for r in rest {
        let modes = if r.modes == 1 { "mode " } else { "modes" };
        let _ = writeln!(
            text,
            "   {:3} {modes}         {:12.6} {:11.6} {:14.6e}",
            r.modes, r.m_0, r.height, r.inertia
        );
    }
}
