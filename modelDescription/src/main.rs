//! Rewrites modelDescription.xml from the variable table.

fn main() -> Result<(), Box<dyn std::error::Error>> {
    std::fs::write(model_description::PATH, model_description::xml()?)?;
    println!("wrote {}", model_description::PATH);
    Ok(())
}
