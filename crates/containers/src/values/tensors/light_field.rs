//! Light at points.

use safetensors::tensor::Dtype;
use sh::Expansion;
use transfer::LightField;

use super::file::{TensorFile, Writer, coefficients, degree, wrong_shape};
use crate::error::{Error, ErrorKind};

const POINTS: &str = "points";
const SERIES: &str = "sh";

/// A light field: `points` [P, 3] and the light at each, `sh` [P, (F+1)^2, 3], both f64.
///
/// # Errors
/// If a number is not finite.
pub fn encode_light_field(field: &LightField, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    let (count, rows) = (field.points().len(), field.degree().rows());
    let mut file = Writer::new("light-field", recipe);
    file.coefficients(POINTS, field.points(), &[count, 3])?;
    let series: Vec<[f64; 3]> =
        field.lights().iter().flat_map(|light| light.coefficients()).copied().collect();
    file.coefficients(SERIES, &series, &[count, rows, 3])?;
    Ok(file.finish())
}

/// A light field, from a file of kind `light-field`.
///
/// # Errors
/// The errors of [`super::decode_lighting`] and of [`LightField::new`].
pub fn decode_light_field(bytes: &[u8]) -> Result<LightField, Error> {
    const PLACES: &str = "[P, 3]";
    const SHAPE: &str = "[P, (F+1)^2, 3]";
    let file = TensorFile::open_as(bytes, "light-field")?;
    let tensor = file.tensor(POINTS, Dtype::F64, PLACES)?;
    let &[count, 3] = tensor.shape() else { return Err(wrong_shape(POINTS, PLACES, tensor.shape())) };
    let points = coefficients(POINTS, &tensor)?;
    let tensor = file.tensor(SERIES, Dtype::F64, SHAPE)?;
    let wrong = || wrong_shape(SERIES, SHAPE, tensor.shape());
    let &[lights, rows, 3] = tensor.shape() else { return Err(wrong()) };
    let side = rows.isqrt();
    if lights != count || side == 0 || side * side != rows {
        return Err(wrong());
    }
    let degree = degree(SERIES, side - 1)?;
    let series = coefficients(SERIES, &tensor)?;
    let light = |rows: &[[f64; 3]]| Expansion::from_coefficients(degree, rows.to_vec()).ok_or_else(wrong);
    let lights = series.chunks_exact(rows).map(light).collect::<Result<_, _>>()?;
    LightField::new(points, lights).map_err(|error| Error::new(ErrorKind::Damaged, error.to_string()))
}

#[cfg(test)]
mod tests {
    use sh::Degree;

    use super::*;

    fn field() -> LightField {
        let degree = Degree::new(1).unwrap();
        let light = |x: f64| Expansion::from_coefficients(degree, vec![[x, 0.5, -1.0]; 4]).unwrap();
        LightField::new(vec![[0.0; 3], [1.0, 2.0, 3.0]], vec![light(0.1), light(7.0)]).unwrap()
    }

    #[test]
    fn light_at_points_comes_back() {
        let bytes = encode_light_field(&field(), Some("{}")).unwrap();
        assert_eq!(decode_light_field(&bytes).unwrap(), field());
        let tensors = crate::values::tensors::describe(&bytes).unwrap().tensors;
        let expected = [("points", vec![2, 3]), ("sh", vec![2, 4, 3])];
        assert_eq!(tensors, expected.map(|(name, shape)| (name.to_owned(), "F64".to_owned(), shape)));
        for length in 0..bytes.len() {
            assert!(decode_light_field(&bytes[..length]).is_err(), "cut at {length}");
        }
    }

    #[test]
    fn errors_name_the_tensor_and_what_was_expected() {
        let written = |points: &[[f64; 3]], rows: usize, of: usize| {
            let mut file = Writer::new("light-field", None);
            file.coefficients(POINTS, points, &[points.len(), 3]).unwrap();
            file.coefficients(SERIES, &vec![[1.0; 3]; rows * of], &[of, rows, 3]).unwrap();
            decode_light_field(&file.finish()).map_err(|error| error.to_string())
        };
        assert!(written(&[[0.0; 3]], 9, 1).is_ok());
        for (points, rows, of, expected) in [
            (&[[0.0; 3]][..], 8, 1, "tensor `sh`: expected the shape [P, (F+1)^2, 3], found [1, 8, 3]"),
            (&[[0.0; 3]], 4, 2, "tensor `sh`: expected the shape [P, (F+1)^2, 3], found [2, 4, 3]"),
            (&[], 4, 0, "a light field needs at least one point"),
            (&[[1.0; 3]; 2], 4, 2, "points 0 and 1 are the same place"),
        ] {
            assert_eq!(written(points, rows, of).unwrap_err(), expected);
        }
        let nan = Expansion::from_coefficients(Degree::ZERO, vec![[f64::NAN; 3]]).unwrap();
        let field = LightField::new(vec![[0.0; 3]], vec![nan]).unwrap();
        assert_eq!(encode_light_field(&field, None).unwrap_err().kind(), ErrorKind::Unwritable);
        let mut bytes = encode_light_field(&self::field(), None).unwrap();
        let last = bytes.len() - 8;
        bytes[last..].copy_from_slice(&f64::INFINITY.to_le_bytes());
        let error = decode_light_field(&bytes).unwrap_err().to_string();
        assert_eq!(error, "tensor `sh`: expected finite values; row 7, channel 2 is not");
    }
}
