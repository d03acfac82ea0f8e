//! Rewrites what is committed and follows from something else: each FMU's modelDescription.xml
//! and page of variables from its variable table, the icon's pixels from its drawing.

use model_description::{icon, path, variables, xml};
use runtime::Model;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    write::<HubSlosh::HubSlosh>()?;
    write::<Spacecraft::Model>()?;
    write::<SloshTank::Model>()?;
    let picture = icon::draw(&std::fs::read_to_string(icon::SOURCE)?)?;
    std::fs::write(icon::PATH, picture.encode_png()?)?;
    println!("wrote {}", icon::PATH);
    Ok(())
}

fn write<M: Model>() -> Result<(), Box<dyn std::error::Error>> {
    std::fs::write(path::<M>(), xml::<M>()?)?;
    std::fs::write(variables::path::<M>(), variables::page::<M>())?;
    println!("wrote {}\nwrote {}", path::<M>().display(), variables::path::<M>().display());
    Ok(())
}
