//! Writes the committed files that are generated from the variable table of each FMU: modelDescription.xml, the page of
//! variables, and the names for the harness. With the feature `icon` it also draws the icon.

use model_description::{fmi3, names, path, variables, xml};
use runtime::Model;
use runtime::table::Layout;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    write::<HubSlosh::HubSlosh>()?;
    write::<Spacecraft::Model>()?;
    write::<SloshTank::Model>()?;
    #[cfg(feature = "icon")]
    write_icon()?;
    Ok(())
}

fn write<M: Model>() -> Result<(), Box<dyn std::error::Error>> {
    std::fs::write(path::<M>(), xml::<M>()?)?;
    for layout in Layout::ALL {
        let fmi3 = fmi3::path::<M>(layout);
        std::fs::create_dir_all(fmi3.with_file_name(""))?;
        std::fs::write(&fmi3, fmi3::xml::<M>(layout)?)?;
        println!("wrote {}", fmi3.display());
    }
    std::fs::write(variables::path::<M>(), variables::page::<M>())?;
    println!("wrote {}\nwrote {}", path::<M>().display(), variables::path::<M>().display());
    std::fs::write(names::path::<M>(), names::module::<M>())?;
    println!("wrote {}", names::path::<M>().display());
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
