//! Rewrites what is committed and follows from something else: modelDescription.xml and the
//! page of variables from the variable table, the icon's pixels from its drawing.

use model_description::{PATH, icon, variables, xml};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    std::fs::write(PATH, xml()?)?;
    std::fs::write(variables::PATH, variables::page())?;
    let picture = icon::draw(&std::fs::read_to_string(icon::SOURCE)?)?;
    std::fs::write(icon::PATH, picture.encode_png()?)?;
    for path in [PATH, variables::PATH, icon::PATH] {
        println!("wrote {path}");
    }
    Ok(())
}
