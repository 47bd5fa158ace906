//! What is written about a trained network.

use crate::config::Config;
use crate::data::Sets;
use crate::score::figure;
use crate::source::Source;
use crate::task::Verdict;

/// The model card: what the network is, from what it learned, and what it reached.
pub(crate) fn card<V: Verdict>(
    config: &Config,
    words: &str,
    verdict: &V,
    epochs: usize,
    best: (usize, Option<f64>),
    sets: &Sets,
    frames: &[Source],
) -> String {
    let sets = [("training", &sets.training), ("validation", &sets.validation), ("test", &sets.test)];
    let d = &config.data;
    let mut text = format!("# Model card\n\n{words}\n\n");
    text += &format!(
        "It learned from simulated frames alone: {} for training, {} for validation and {} for the test, shared out by {}, from \
         these runs:\n\n",
        sets[0].1.len(),
        sets[1].1.len(),
        sets[2].1.len(),
        d.split.words()
    );
    for run in &config.runs() {
        // The name alone: the folder is one of whoever trained it.
        text += &format!("* {}\n", run.file_name().unwrap_or(run.as_os_str()).to_string_lossy());
    }
    let scenes = |places: &[usize]| -> String {
        let mut all: Vec<usize> = places.iter().map(|p| frames[*p].scene).collect();
        all.dedup();
        all.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")
    };
    text += "\nScenes, counted through these folders in their order:\n\n";
    for (name, places) in &sets {
        text += &format!("* {name}: {}\n", scenes(places));
    }
    text += &format!(
        "\nThe seed is {}. {} epochs were trained; the weights are those of epoch {}, which had the best mean {} of the \
         validation set, {}.\n\n",
        config.training.seed.value,
        epochs,
        best.0,
        V::FIGURE,
        figure(best.1),
    );
    text += &verdict.card();
    text += "\nIt was not tested on recorded data.\n";
    text
}
