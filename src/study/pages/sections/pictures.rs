//! Part 1, continued: pictures of equal time, error maps, the winner of each region.

use crate::study::data::{Method, Study};
use crate::study::pages::escape::{picture, xml};
use crate::study::pages::number::{THIN, percent, plain, seconds_of};
use crate::study::pages::parts::{list, method, missing, paragraph, plot};
use crate::study::pages::plot::{Look, Map, looks};
use crate::study::pages::verdict;

/// Which method wins how much of the picture.
pub fn takeaway(study: &Study) -> Option<String> {
    let map = map(study)?;
    let mut shares: Vec<(f64, &str)> =
        map.shares().into_iter().zip(map.methods.iter().map(|m| m.0)).collect();
    shares.retain(|(share, _)| *share > 0.0);
    shares.sort_by(|a, b| b.0.total_cmp(&a.0));
    let ((share, best), rest) = shares.split_first()?;
    let time = seconds_of(map.regions.seconds);
    if rest.is_empty() {
        return Some(format!("In {time}, {best} has the least error in every region."));
    }
    let rest: Vec<String> =
        rest.iter().map(|(s, name)| format!("{name} in {}{THIN}%", plain(100.0 * s, 2))).collect();
    Some(format!(
        "In {time}, {best} has the least error in {}{THIN}% of the picture, {}.",
        plain(100.0 * share, 2),
        list(&rest)
    ))
}

fn map(study: &Study) -> Option<Map<'_>> {
    let regions = study.regions.as_ref()?;
    let [width, height] = study.size.map(f64::from);
    let names = study.methods.iter().map(|m| m.name.as_str());
    Some(Map {
        label: "The method of least error, region by region".into(),
        regions,
        methods: names.zip(looks(&study.methods)).collect(),
        aspect: height / width,
        picture: study.reference.as_ref().map_or("", |r| r.picture.as_str()),
    })
}

/// Pictures and map.
pub fn html(study: &Study) -> String {
    let mut body = String::new();
    if let Some(text) = takeaway(study) {
        body += &paragraph(&text);
    }
    let shown: String = study
        .methods
        .iter()
        .zip(looks(&study.methods))
        .filter_map(|(m, look)| pair(study, m, look))
        .collect();
    if shown.is_empty() {
        body += &missing(study, "Pictures of equal time were", "pictures");
    } else {
        let reference = study.reference.as_ref().and_then(|r| {
            Some(figure(
                &[(picture(&r.picture)?, "the reference")],
                &xml(&format!("Reference: {}", crate::study::pages::sections::origin::made_by(r))),
            ))
        });
        body += &format!("<div class=\"pictures broad\">\n{}{shown}</div>\n", reference.unwrap_or_default());
        body += "<p class=\"dim\">Below each picture, its FLIP error map: where the displayed picture differs visibly from the \
                 reference. Brighter is worse.</p>\n";
    }
    if let Some(map) = map(study) {
        body += &plot(
            &map.label,
            "The method of least mean square error in each region, at equal time.",
            |size| map.draw(size),
        );
    }
    body
}

/// A method's picture and error map.
fn pair(study: &Study, m: &Method, look: Look) -> Option<String> {
    let seen = m.picture.as_deref().and_then(picture)?;
    let mut all = vec![(seen, "displayed picture")];
    all.extend(m.error_map.as_deref().and_then(picture).map(|uri| (uri, "FLIP error map")));
    let seconds = study.regions.as_ref().map(|r| r.seconds).or_else(|| verdict::shared_seconds(study));
    let point = seconds.and_then(|s| verdict::at_time(m, s));
    let error = point.and_then(|p| Some((verdict::error_of(p)?, p)));
    let text = error.map_or_else(String::new, |(e, p)| {
        let (error, flip) = (percent(&e).main, plain(p.flip.value, 2));
        format!(" after {}: {error}, FLIP {flip}", seconds_of(p.seconds))
    });
    Some(figure(&all, &format!("{}{}", method(&m.name, look), xml(&text))))
}

/// Pictures above one another; the caption is HTML already.
fn figure(pictures: &[(&str, &str)], caption: &str) -> String {
    let image = |(uri, alt): &(&str, &str)| format!("<img src=\"{}\" alt=\"{}\"/>", xml(uri), xml(alt));
    let images: String = pictures.iter().map(image).collect();
    format!("<figure>{images}<figcaption>{caption}</figcaption></figure>\n")
}
