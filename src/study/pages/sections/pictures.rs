//! Part 1, continued: pictures over time, pictures at equal time with error maps, best method per region.

use maud::{Markup, html};

use crate::study::data::{CurvePoint, MethodResult, Study};
use crate::study::format::{THIN, percent_interval, percent_of, seconds_of, significant};
use crate::study::measurement::FIGURES;
use crate::study::pages::chart::{MethodStyle, RegionMap, styled};
use crate::study::pages::page::reference_origin;
use crate::study::pages::parts::{embedded, list, method, missing, note, pictures};
use crate::study::pages::verdict;

/// Pictures, error maps and the map of regions.
pub fn html(study: &Study) -> Markup {
    let shown: Vec<Markup> = styled(study).filter_map(|(m, style)| equal_time(study, m, style)).collect();
    let reference = study.reference.as_ref().and_then(|r| {
        let caption = html! { "Reference: " (reference_origin(r)) };
        Some(pictures(&[(embedded(Some(&r.picture))?, "the reference".into())], &caption))
    });
    html! {
        (as_time_goes_on(study))
        h3 { "Equal-time pictures" (size(study)) }
        @if let Some(text) = conclusion(study) { p { (text) } }
        @if shown.is_empty() { (missing(study, "Pictures of equal time were", "pictures")) }
        @else {
            div.pictures.broad { @if let Some(reference) = reference { (reference) } @for picture in shown { (picture) } }
            p.dim { "Below each picture is its FLIP error map: where a viewer would see a difference from the reference. Brighter is worse." }
        }
        @if let Some(map) = region_map(study) {
            figure.regions {
                (map.draw().inline("The method of least error, region by region"))
                (map.legend())
                figcaption { "The method of least mean square error in each region, at equal time." }
            }
        }
    }
}

/// Fraction of the picture in which each method is best.
pub fn conclusion(study: &Study) -> Option<String> {
    let map = region_map(study)?;
    let mut shares: Vec<(f64, &str)> =
        map.shares().into_iter().zip(map.methods.iter().map(|m| m.0)).collect();
    shares.retain(|(share, _)| *share > 0.0);
    shares.sort_by(|a, b| b.0.total_cmp(&a.0));
    let ((share, best), rest) = shares.split_first()?;
    let time = seconds_of(map.regions.seconds);
    if rest.is_empty() {
        return Some(format!("In {time}, {best} has the least error in every region."));
    }
    let rest: Vec<String> = rest.iter().map(|(s, name)| format!("{name} in {}", percent_of(*s))).collect();
    let (share, rest) = (percent_of(*share), list(&rest));
    Some(format!("In {time}, {best} has the least error in {share} of the picture, {rest}."))
}

fn region_map(study: &Study) -> Option<RegionMap<'_>> {
    let [width, height] = study.size.map(f64::from);
    Some(RegionMap {
        regions: study.regions.as_ref()?,
        methods: styled(study).map(|(m, style)| (m.name.as_str(), style)).collect(),
        aspect: height / width,
        picture: embedded(study.reference.as_ref().map(|r| r.picture.as_str())),
    })
}

fn equal_time(study: &Study, m: &MethodResult, style: MethodStyle) -> Option<Markup> {
    let mut all = vec![(embedded(m.picture.as_deref())?, format!("{}, displayed picture", m.name))];
    all.extend(embedded(m.error_map.as_deref()).map(|uri| (uri, format!("{}, FLIP error map", m.name))));
    let seconds = study.regions.as_ref().map(|r| r.seconds).or_else(|| verdict::shared_seconds(study));
    let point = seconds.and_then(|s| verdict::at_time(m, s));
    let caption = html! {
        (method(&m.name, style))
        @if let Some((p, error)) = point.and_then(|p| Some((p, verdict::error_of(p)?))) {
            " after " (seconds_of(p.seconds)) ": " (percent_interval(&error).main) (flip(p))
        }
    };
    Some(pictures(&all, &caption))
}

/// The methods after 1/30, 1/3, 3 and 30 seconds side by side, as in Figures 3 and 4 of the paper.
fn as_time_goes_on(study: &Study) -> Markup {
    let at = |m: &MethodResult, seconds: f64| {
        m.points.iter().position(|p| p.budget == seconds && p.picture.is_some())
    };
    // Every method has a cell for every time of any method, so that pictures of equal time are aligned.
    let times: Vec<f64> =
        FIGURES.into_iter().filter(|s| study.methods.iter().any(|m| at(m, *s).is_some())).collect();
    let snapshots = |m: &MethodResult| -> Vec<Option<Markup>> {
        times.iter().map(|&s| snapshot(&m.name, s, &m.points[at(m, s)?])).collect()
    };
    let mut rows: Vec<_> = styled(study).map(|(m, style)| (m, style, snapshots(m))).collect();
    rows.retain(|(.., snapshots)| snapshots.iter().any(Option::is_some));
    let missing = FIGURES.into_iter().filter(|s| study.methods.iter().all(|m| at(m, *s).is_none()));
    let late: Vec<String> = missing.map(time_name).collect();
    html! {
        @if !rows.is_empty() {
            h3 { "As time goes on" (size(study)) }
            @for (m, style, cells) in &rows {
                p.dim { (method(&m.name, *style)) }
                div.snapshots style={ "--columns:" (times.len()) } { @for cell in cells { @match cell { Some(cell) => (cell), None => figure {} } } }
            }
            @let missing = if late.is_empty() { String::new() } else { format!(" {} did not fit into the budget.", list(&late)) };
            (note(&format!("The displayed picture, its error at 95{THIN}% of the picture, and its FLIP.{missing}")))
        }
    }
}

fn snapshot(of: &str, seconds: f64, point: &CurvePoint) -> Option<Markup> {
    let time = time_name(seconds);
    let error =
        verdict::error_of(point).map_or_else(String::new, |e| format!(": {}", percent_interval(&e).main));
    let caption = html! { (time) (error) (flip(point)) };
    Some(pictures(&[(embedded(point.picture.as_deref())?, format!("{of} after {time}"))], &caption))
}

/// The size of the pictures, for a heading: `, 512 × 512 pixels`.
fn size(study: &Study) -> String {
    let [width, height] = study.size;
    if width == 0 { String::new() } else { format!(", {width}{THIN}×{THIN}{height} pixels") }
}

/// `, FLIP 0.12`.
fn flip(point: &CurvePoint) -> String {
    point.flip.map_or_else(String::new, |flip| format!(", FLIP {}", significant(flip.value, 2)))
}

/// `1/30 s`.
fn time_name(seconds: f64) -> String {
    if seconds < 1.0 { format!("1/{:.0}{THIN}s", 1.0 / seconds) } else { format!("{seconds:.0}{THIN}s") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::pages::sample;

    #[test]
    fn the_times_of_the_paper_stand_side_by_side() {
        let mut study = sample::study();
        let text = as_time_goes_on(&study).into_string();
        for time in ["1/30", "1/3", "3", "30"] {
            assert!(text.contains(&format!("path after {time}{THIN}s")), "{time}: {text}");
        }
        assert!(!text.contains("did not fit"));
        for m in &mut study.methods {
            m.points.retain(|p| p.budget < 3.0);
        }
        let text = as_time_goes_on(&study).into_string();
        assert!(text.contains(&format!("3{THIN}s and 30{THIN}s did not fit")), "{text}");
        study.methods.clear();
        assert_eq!(as_time_goes_on(&study).into_string(), "");
    }
}
