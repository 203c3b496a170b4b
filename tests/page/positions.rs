//! Positions of the workbench, edited by mouse, keyboard and touch, and the delay of the verdict.

use std::fs;
use std::time::Duration;

use serde_json::{Value, json};

use crate::browser::Browser;
use crate::opened::{
    choose, click, drag, key, names, opened, place, quiet, root, says, scheme, swipe, thumb, wait, write,
    wrong,
};
use crate::program::{cases, run};

#[test]
fn positions_are_edited() {
    let Some((mut browser, _)) = opened(1400) else { return };
    let b = &mut browser;
    // the paper's two positions
    says(b, "psi_y", 3, "inseparable");
    says(b, "D_FY", 2, "2");
    wait(b, "links", "document.querySelectorAll('#links path').length == 1");
    wait(b, "formulas", "document.querySelectorAll('#verdicts td.solution math').length > 6");
    wait(
        b,
        "sigmas",
        "document.querySelector('#verdicts table:not(.old-sigmas):not(.old-solutions)') && \
         document.querySelectorAll('#verdicts td.sigma:not(:empty)').length == 15",
    );
    // slider: psi_y becomes observable, and the row shows its previous status
    click(b, "#positions li:nth-child(2) .name");
    let (from, to) = (thumb(b, "alpha", 180.0), thumb(b, "alpha", 90.0));
    drag(b, from, to, 20, Duration::from_millis(5));
    says(b, "psi_y", 2, "0 was inseparable");
    wait(b, "highlight", "document.querySelector('tr[data-name=psi_y]').classList.contains('changed')");
    let turned = b.value("Number(document.getElementById('alpha').value)").as_f64().expect("a number");
    assert!((turned - 90.0).abs() <= 10.0 && turned % 5.0 == 0.0, "{turned}");
    // one gesture is one step of undo and redo
    key(b, "z", 90, 2);
    says(b, "psi_y", 3, "inseparable");
    click(b, "#redo");
    says(b, "psi_y", 2, "0");
    click(b, "#undo");
    // marks: psi_y is not observable at alpha 0 and 180
    click(b, "#redo");
    wait(b, "marks", "document.querySelectorAll('#alpha-marks i').length >= 2");
    let marks = b.value("document.getElementById('alpha').title");
    let marks = marks.as_str().expect("a title");
    for angle in ["-180", " 0,", "180"] {
        assert!(marks.contains(angle), "{marks}");
    }
    wait(b, "strip", "document.getElementById('strip-caption').textContent.includes('sigma of psi_y')");
    let [x, y, w, _] = place(b, "#strip");
    let at = [x + 52.0 + (w - 56.0) * 0.75, y + 20.0];
    drag(b, at, at, 1, Duration::from_millis(5));
    wait(b, "strip sets the angle", "Math.abs(Number(document.getElementById('alpha').value) - 90) <= 5");
    choose(b, "#strip-of", "D_FX");
    wait(
        b,
        "another sigma",
        "document.getElementById('strip-caption').textContent.includes('sigma of D_FX')",
    );
    b.value("document.getElementById('strip').focus(), 1");
    let before = b.value("Number(document.getElementById('alpha').value)").as_f64().expect("a number");
    key(b, "ArrowRight", 39, 0);
    wait(b, "a step along the strip", &format!("document.getElementById('alpha').value == {}", before + 5.0));
    key(b, "z", 90, 2);
    wait(b, "and back", &format!("document.getElementById('alpha').value == {before}"));
    key(b, "y", 89, 2);
    wait(b, "and forth", &format!("document.getElementById('alpha').value == {}", before + 5.0));
    wait(b, "drop one", "document.getElementById('drop-one').textContent.includes('Without p2: psi_y')");
    wait(
        b,
        "of each position",
        "document.querySelectorAll('#positions .need')[1].textContent.startsWith('needed for')",
    );
    // letters, numbers, snapping
    write(b, "#letters", "uen");
    wait(b, "letters", "obsdeg.scheme().includes('attitude = \"UEN\"')");
    says(b, "D_IX", 3, "inseparable");
    write(b, "#letters", "NNE");
    wait(b, "wrong letters", &wrong("letters", "NNE"));
    let answers = "performance.getEntriesByName('table').length";
    let before = b.value(answers);
    write(b, "#beta-number", "12.5");
    wait(b, "a number", "obsdeg.scheme().includes('12.5')");
    // the answer to an earlier question does not remove the refusal
    write(b, "#beta-number", "x");
    wait(b, "the answer before", &format!("{answers} > {before}"));
    wait(b, "no number", &wrong("beta-number", "beta: expected a number of degrees"));
    choose(b, "#snap", "45");
    assert_eq!(b.value("document.getElementById('gamma').step"), json!("45"));
    b.value("document.getElementById('gamma').focus(), 1");
    key(b, "ArrowRight", 39, 0);
    wait(b, "snapped", "Number(document.getElementById('gamma').value) % 45 == 0");
    write(b, "#name", "second");
    write(b, "#own-dwell", "300");
    wait(
        b,
        "name and dwell",
        "obsdeg.scheme().includes('name = \"second\"') && obsdeg.scheme().includes('dwell_s = 300')",
    );
    // a refusal by the engine is shown, and the table is not presented as its verdict
    write(b, "#name", "<b>");
    wait(b, "refused", &wrong("name", "position name"));
    wait(b, "stale", "document.getElementById('summary').textContent.startsWith('not judged')");
    write(b, "#name", "second");
    wait(b, "judged again", "document.getElementById('summary').textContent.startsWith('rank')");
    // list: add, duplicate, delete, reorder by mouse and by keyboard
    click(b, "#add");
    click(b, "#duplicate");
    wait(b, "four", "document.querySelectorAll('#positions li').length == 4");
    click(b, "#delete");
    wait(b, "three", "document.querySelectorAll('#positions li').length == 3");
    click(b, "#duplicate");
    b.value("document.querySelector('#positions li.chosen .name').focus(), 1");
    key(b, "Delete", 46, 0);
    wait(b, "three again", "document.querySelectorAll('#positions li').length == 3");
    let [x, y, w, h] = place(b, "#positions li:nth-child(2) .grip");
    let [_, last, _, height] = place(b, "#positions li:nth-child(3)");
    drag(b, [x + w / 2.0, y + h / 2.0], [x + w / 2.0, last + height - 4.0], 8, Duration::from_millis(5));
    let order = names(b);
    assert!(order[2].as_str().is_some_and(|n| n.starts_with("second")), "{order}");
    b.value("document.querySelector('#positions li:nth-child(3) .name').focus(), 1");
    key(b, "ArrowUp", 38, 1);
    let order = names(b);
    assert!(order[1].as_str().is_some_and(|n| n.starts_with("second")), "{order}");
    assert_eq!(b.value("document.activeElement.textContent.startsWith('second')"), json!(true));
    click(b, "#positions li:nth-child(2) .moves button:first-child");
    assert!(names(b)[0].as_str().is_some_and(|n| n.starts_with("second")));
    // the view turns by mouse and by keyboard, and the slew ends at the next position
    let picture = "document.getElementById('view').toDataURL()";
    let before = b.value(picture);
    let [x, y, w, h] = place(b, "#view");
    drag(b, [x + w / 2.0, y + h / 2.0], [x + w / 2.0 + 80.0, y + h / 2.0], 5, Duration::from_millis(5));
    let after = b.value(picture);
    assert_ne!(before, after);
    b.value("document.getElementById('view').focus(), 1");
    key(b, "ArrowLeft", 37, 0);
    assert_ne!(b.value(picture), after);
    click(b, "#gyro-axes");
    click(b, "#slew");
    wait(b, "slew", "document.querySelector('#positions li:nth-child(2)').classList.contains('chosen')");
    // conditions
    choose(b, "#carry", "inertial");
    write(b, "#terms", "F,S");
    wait(b, "terms", "document.getElementById('summary').textContent.includes('of 9')");
    write(b, "#dwell", "250");
    write(b, "#noise", "2e-5");
    write(b, "#drift-noise", "0.001 deg/sqrt(h)");
    write(b, "#requirements", "D = 0.02, psi = 0.01");
    write(b, "#latitude-number", "48");
    let text = scheme(b);
    for line in [
        "carry = \"inertial\"",
        "terms = [\"F\", \"S\"]",
        "dwell_s = 250",
        "accelerometer_noise_g = 0.00002",
        "drift_noise = \"0.001 deg/sqrt(h)\"",
        "D = 0.02",
        "latitude_deg = 48",
    ] {
        assert!(text.contains(line), "{line} is not in {text}");
    }
    // the command line reads the page's file and gives the same verdicts
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("scheme.toml");
    fs::write(&file, &text).expect("written");
    let answer = run(&["analyze", file.to_str().expect("text"), "--solutions", "off", "--format", "json"]);
    let answer: Value = serde_json::from_slice(&answer.stdout).expect("JSON");
    wait(
        b,
        "the same rank",
        &format!("document.getElementById('summary').textContent.startsWith('rank {} of 9')", answer["rank"]),
    );
    click(b, "#generic");
    wait(b, "generic", "!obsdeg.scheme().includes('latitude')");
    click(b, "#latitude");
    wait(b, "the equator", "obsdeg.scheme().includes('latitude_deg = 0\\n')");
    key(b, "End", 35, 0);
    wait(b, "the pole", "obsdeg.scheme().includes('latitude_deg = 90')");
    quiet(b);
}

/// Attitudes in letters agree between page and engine.
#[test]
fn attitudes_are_those_of_the_engine() {
    let Some((mut browser, _)) = opened(1400) else { return };
    for angles in ["0,0,0", "90,0,0", "0,90,0", "0,0,90", "-90,180,90", "90,90,0", "180,-90,90"] {
        let numbers: Vec<f64> = angles.split(',').map(|a| a.parse().expect("a number")).collect();
        for (axis, x) in ["alpha", "beta", "gamma"].iter().zip(numbers) {
            write(&mut browser, &format!("#{axis}-number"), &x.to_string());
        }
        let answer = run(&["analyze", "--angles", angles, "--solutions", "off", "--format", "json"]);
        let answer: Value = serde_json::from_slice(&answer.stdout).expect("JSON");
        let letters = answer["positions"][0]["attitude"].as_str().expect("letters").to_string();
        wait(&mut browser, angles, &format!("document.getElementById('letters').value == {letters:?}"));
        // reverse direction: the angles of the letters give the same attitude
        write(&mut browser, "#letters", &letters);
        wait(&mut browser, angles, &format!("document.getElementById('letters').value == {letters:?}"));
    }
    quiet(&browser);
}

/// Touch: a slider, the order, the view. About the axis between two positions, verdicts differ at the angle
/// of the other position, at its mirror image, and half a turn from both.
#[test]
fn marks_are_where_positions_stand_alike() {
    let Some((mut browser, _)) = opened(1400) else { return };
    let b = &mut browser;
    write(b, "#alpha-number", "12");
    click(b, "#positions li:nth-child(2) .name");
    write(b, "#alpha-number", "90");
    let title = "document.getElementById('alpha').title";
    wait(b, "marks", &format!("{title}.startsWith('Other verdicts at -168, -12, 12, 168 deg (tried:')"));
    let places = b.value(
        "[...document.querySelectorAll('#alpha-marks i')].map(e => Math.round(parseFloat(e.style.left) * 3.6 - 180))",
    );
    assert_eq!(places, json!([-168, -12, 12, 168]));
    // the command line gives the same at each of these angles and beside them
    for (angle, observable) in
        [("12", 1), ("-168", 2), ("-12", 6), ("168", 6), ("11", 3), ("-169", 3), ("13", 3)]
    {
        let angles = format!("--angles={angle},0,0");
        let output = run(&["analyze", "--angles", "12,0,0", &angles, "--format", "json"]);
        let answer: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let quantities = answer["quantities"].as_array().expect("a list");
        assert_eq!(quantities.iter().filter(|q| q["degree"].is_number()).count(), observable, "{angle}");
    }
    quiet(b);
}

#[test]
fn it_is_touched() {
    let Some((mut browser, _)) = opened(400) else { return };
    let b = &mut browser;
    b.call("Emulation.setTouchEmulationEnabled", json!({ "enabled": true }));
    click(b, "#positions li:nth-child(2) .name");
    let (from, to) = (thumb(b, "alpha", 180.0), thumb(b, "alpha", 90.0));
    swipe(b, from, to);
    wait(b, "turned", "Math.abs(Number(document.getElementById('alpha').value) - 90) <= 15");
    wait(
        b,
        "observable",
        "document.querySelector('tr[data-name=psi_y] td.degree').textContent.startsWith('0')",
    );
    // the summary stays in sight
    let seen = "(() => { const r = document.getElementById('summary').getBoundingClientRect(); \
                return r.top >= 0 && r.bottom <= innerHeight && r.height > 10; })()";
    assert_eq!(b.value(seen), json!(true));
    let [x, y, w, h] = place(b, "#positions li:nth-child(1) .grip");
    let [_, last, _, height] = place(b, "#positions li:nth-child(2)");
    swipe(b, [x + w / 2.0, y + h / 2.0], [x + w / 2.0, last + height - 4.0]);
    wait(b, "order", "document.querySelectorAll('#positions .name')[1].textContent == 'p2   0, 0, 0'");
    let picture = "document.getElementById('view').toDataURL()";
    let [x, y, w, h] = place(b, "#view");
    let before = b.value(picture);
    swipe(b, [x + w / 2.0, y + h / 2.0], [x + w / 2.0 + 80.0, y + h / 2.0]);
    assert_ne!(b.value(picture), before);
    quiet(b);
}

/// Dragging a slider with six positions; a crash; 400 positions.
#[test]
#[expect(clippy::print_stderr, reason = "what was measured")]
fn it_keeps_up() {
    let Some((mut browser, _)) = opened(1400) else { return };
    let b = &mut browser;
    let open = |b: &mut Browser, text: &str| {
        b.value(&format!(
            "(() => {{ const held = new DataTransfer(); held.items.add(new File([{}], 'many.toml')); \
             document.dispatchEvent(new DragEvent('drop', {{ dataTransfer: held, bubbles: true, cancelable: true \
             }})); }})()",
            json!(text)
        ));
    };
    let six = fs::read_to_string(root().join("examples/six-positions/scheme.toml")).expect("readable");
    open(b, &six);
    wait(b, "six", "document.querySelectorAll('#positions li').length == 6");
    let settled = "document.querySelector('#verdicts table:not(.old-sigmas):not(.old-solutions)') && \
                   document.querySelectorAll('#verdicts td.sigma:not(:empty)').length == 15";
    // time of the engine alone for the same question, measured here because parallel tests slow down both
    let alone = format!(
        "(async () => {{ const times = []; for (let i = 0; i < 21; i++) {{ const from = performance.now(); \
         await obsdeg.ask('verdicts', [{{ sources: [{{ name: 'six.toml', text: {} }}], solutions: false, omitted: \
         false }}]); \
         times.push(performance.now() - from); }} return times.sort((a, b) => a - b)[10]; }})()",
        json!(six)
    );
    // the best of a few drags
    let mut least = f64::INFINITY;
    for round in 0..cases(3, 5) {
        wait(b, "sigmas and solutions", settled);
        b.value("performance.clearMeasures(), 1");
        let engine = b.value(&alone).as_f64().expect("milliseconds");
        let ends = [10.0, 170.0].map(|angle| if round % 2 == 0 { angle } else { 180.0 - angle });
        let (from, to) = (thumb(b, "alpha", ends[0]), thumb(b, "alpha", ends[1]));
        drag(b, from, to, 60, Duration::from_millis(30));
        wait(
            b,
            "the last angle",
            &format!("Math.abs(document.getElementById('alpha').value - {}) <= 15", ends[1]),
        );
        wait(b, "its table", settled);
        let times =
            b.value("performance.getEntriesByName('table').map(m => m.duration).sort((a, b) => a - b)");
        let times: Vec<f64> = times.as_array().expect("a list").iter().filter_map(Value::as_f64).collect();
        assert!(times.len() > 10, "{times:?}");
        let found = [0.5, 0.95].map(|part| times[((times.len() - 1) as f64 * part) as usize]);
        eprintln!(
            "from input to table, {} inputs: median {:.1} ms, 95 % {:.1} ms; the engine alone {engine:.1} ms",
            times.len(),
            found[0],
            found[1]
        );
        least = least.min(found[0] / engine);
    }
    // outdated questions are skipped, and drawing the table takes no longer than the engine
    assert!(least < 3.0, "{least} times what the engine takes");
    // a crash is reported, and the next question is answered
    let said = b.value("obsdeg.ask('nothing there', []).then(() => 'answered', p => p.message)");
    assert!(
        said.as_str().is_some_and(|s| s.contains("The engine stopped") && s.contains("started again")),
        "{said}"
    );
    click(b, "#undo");
    wait(b, "after the crash", "document.getElementById('summary').textContent.startsWith('rank 15 of 15')");
    let many: String = (0..400)
        .map(|i| {
            format!(
                "[[position]]\nangles_deg = [{}, {}, {}]\n",
                i % 360 - 180,
                (7 * i) % 180 - 90,
                (13 * i) % 360 - 180
            )
        })
        .collect();
    open(b, &many);
    wait(b, "400", "document.querySelectorAll('#positions li').length == 400");
    wait(b, "all", "document.getElementById('summary').textContent.startsWith('rank 15 of 15')");
    write(b, "#gamma-number", "33");
    wait(b, "an edit", "obsdeg.scheme().includes('33]')");
    quiet(b);
}
