//! Rewrites what is committed and follows from something else: each FMU's modelDescription.xml
//! and page of variables from its variable table; with the feature `icon`, the icon's pixels from
//! its drawing. With `--print-spacecraft` it prints the XML of Spacecraft.fmu as compiled, for `hubslosh pack --tanks`.

use model_description::{path, variables, xml};
use runtime::Model;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // of a variant, which is not committed
    if std::env::args().nth(1).as_deref() == Some("--print-spacecraft") {
        print!("{}", xml::<Spacecraft::Model>()?);
        return Ok(());
    }
    write::<HubSlosh::HubSlosh>()?;
    write::<Spacecraft::Model>()?;
    write::<SloshTank::Model>()?;
    #[cfg(feature = "icon")]
    write_icon()?;
    Ok(())
}

fn write<M: Model>() -> Result<(), Box<dyn std::error::Error>> {
    std::fs::write(path::<M>(), xml::<M>()?)?;
    std::fs::write(variables::path::<M>(), variables::page::<M>())?;
    println!("wrote {}\nwrote {}", path::<M>().display(), variables::path::<M>().display());
    Ok(())
}

#[cfg(feature = "icon")]
fn write_icon() -> Result<(), Box<dyn std::error::Error>> {
    use model_description::icon;
    let folder = icon::FOLDER;
    let picture = icon::draw(&std::fs::read_to_string(format!("{folder}/icon.svg"))?)?;
    std::fs::write(format!("{folder}/icon.png"), picture.encode_png()?)?;
    std::fs::write(format!("{folder}/SHA256SUMS"), icon::hashes()?)?;
    println!("wrote {folder}/icon.png");
    Ok(())
}
