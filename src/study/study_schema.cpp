#include "study/study.hpp"

namespace trocar {

std::string study_schema() {
    return R"({
  "$schema": "https://json-schema.org/draft/2020-12/schema",
  "title": "trocar study, format trocar-study-3",
  "description": "What to compare. Every run is made in a process of its own with a time limit; a crash or a time-out is a row. Scene files are relative to the study file. A method is NAME[:key=value,...] as in trocar list; one that this build lacks becomes rows 'absent', an unknown one is bad input.",
  "type": "object",
  "additionalProperties": false,
  "required": ["format", "name", "experiments"],
  "properties": {
    "format": {"const": "trocar-study-3"},
    "name": {"type": "string", "pattern": "^[A-Za-z0-9_-]+$", "description": "Names the folder of the report"},
    "seed": {"type": "integer", "minimum": 0, "default": 1, "description": "Order of the runs, and seed of everything random in a run"},
    "repetitions": {"type": "integer", "minimum": 1, "default": 1, "description": "Fresh processes per combination; intervals are 95 % from 10 up, minimum to maximum below"},
    "time_limit_s": {"type": "number", "exclusiveMinimum": 0, "default": 60, "description": "Per run, s; a longer run is ended and becomes a row timed_out"},
    "device": {
      "description": "What shows the force on the tool, the same for every response of the study: an object, or the same as text (tip=sum,saturation=3) as in trocar run --device",
      "oneOf": [
        {"type": "string", "minLength": 1},
        {"type": "object", "additionalProperties": false,
         "properties": {
           "tip": {"enum": ["fulcrum", "sum"], "default": "fulcrum", "description": "Force at the tip: through the trocar where the body has one, or the plain sum"},
           "saturation": {"type": "number", "minimum": 0, "maximum": 1e6, "default": 8.5, "description": "Largest force shown, N; 0: no limit"},
           "rate": {"type": "number", "minimum": 0, "maximum": 1e9, "default": 0, "description": "Largest change, N/s; 0: off"},
           "filter": {"type": "number", "minimum": 0, "maximum": 1e6, "default": 0, "description": "Low-pass, Hz; 0: off"},
           "ramp": {"type": "number", "minimum": 0, "maximum": 10, "default": 0, "description": "Time in which the force rises after contact begins, s; 0: off"}}}]},
    "reference": {"$ref": "#/$defs/method", "description": "Detector that ratios of times are taken to"},
    "ours": {"$ref": "#/$defs/method", "description": "Response that page one sets against the best of the others; absent: methods written by us against foreign ones"},
    "tuned": {"type": "string", "minLength": 1, "description": "File that trocar tune has written, relative to the study: for responses that are {\"tuned\": METHOD}"},
    "quotes": {
      "type": "array", "minItems": 1,
      "description": "Findings of other published reports on page one: a text with its source, or a report whose sentence and first table stand there",
      "items": {"oneOf": [
        {"type": "string", "minLength": 1},
        {"type": "object", "additionalProperties": false, "required": ["report"],
         "properties": {"report": {"type": "string", "minLength": 1, "description": "Name of its folder, beside that of this report or among those that come with trocar"}}}]}},
    "experiments": {"type": "array", "minItems": 1, "items": {"$ref": "#/$defs/experiment"}}
  },
  "$defs": {
    "experiment": {
      "description": "A product: inputs x detectors x responses x contact generators x steppers x values of the sweep, less what a method excludes. Inputs are scenes, cases or pair_files; or generated scenes, on each of which all detectors take turns in one process; or external data, likewise",
      "type": "object", "additionalProperties": false, "required": ["frames", "detectors"],
      "anyOf": [{"required": ["scenes"]}, {"required": ["cases"]}, {"required": ["pair_files"]}, {"required": ["generated"]}, {"required": ["external"]}],
      "properties": {
        "frames": {"enum": ["replay", "closed_loop"], "description": "replay: every detector on the same prescribed frames. closed_loop: every combination drives its own copy of the scene; needs responses"},
        "clock": {"enum": ["back_to_back", "paced"], "default": "back_to_back", "description": "paced: a closed loop released by the clock, at most one tick per dt of the scene, in turns with an empty loop; takes as long as its ticks at full rate, twice; never judged"},
        "perturbed": {"type": "boolean", "default": false, "description": "Every run is compared with itself: asked twice, in a fresh process, with triangles and bodies in another order, a pair swapped, the origin moved, lengths in millimetres. A replay takes about 20 frames of each scene"},
        "scenes": {"$ref": "#/$defs/scenes"},
        "cases": {"type": "string", "minLength": 1, "description": "Folder of cases, each a folder with expected.json; relative to the study file. A replay takes the cases of meshes, a closed loop those that are scenes"},
        "pair_files": {"type": "array", "minItems": 1, "items": {"type": "string", "pattern": "^data:"}, "description": "Replay. Files of triangle pairs with truth, as trocar tritri reads them; without the data folder they become rows 'unsupported (no data)'"},
        "generated": {"type": "array", "minItems": 1, "uniqueItems": true, "items": {"type": "string", "minLength": 1}, "description": "Replay, and no other input. Scenes of any size by their text, NAME[:key=value,...] as in trocar list. Detectors take turns in one process on equal frames, 160 ticks unless ticks says otherwise and about half a second each; the study's reference takes part twice, which gives the noise. No cycles, truth_stride, between_ticks, repetitions"},
        "external": {"type": "object", "additionalProperties": false, "required": ["format", "files", "source", "licence"], "description": "Replay, and no other input. Data of other groups with answers that nobody here computed; detectors take turns in one process, 5 rounds unless ticks says otherwise. No cycles, truth_stride, between_ticks, repetitions, sweep",
          "properties": {
            "format": {"enum": ["scalable_ccd", "fcl_scenario", "triangle_pairs", "ccd_queries"], "description": "scalable_ccd: folders with two frames, candidates and their answers (Sample-Scalable-CCD-Data). fcl_scenario: scenarios of FCL's test models; pairs by the exact oracle. triangle_pairs: files as trocar tritri reads them. ccd_queries: files of the Sample-Queries, in folders vertex-face or edge-edge"},
            "files": {"type": "array", "minItems": 1, "items": {"type": "string", "pattern": "^data:"}, "description": "Without the data folder they become rows 'unsupported (no data)'"},
            "source": {"type": "string", "minLength": 1, "description": "Printed under the table: who computed the answers, and where the data are from"},
            "licence": {"type": "string", "minLength": 1},
            "reference": {"$ref": "#/$defs/method", "description": "Detector that ratios of times are taken to"}}},
        "dither": {"type": "number", "exclusiveMinimum": 0, "description": "Paced loops. Length in m by which scripted bodies are displaced at every tick, each time in another direction, drawn by the scene's seed: a hand never rests, and the apparent stiffness is that of small displacements"},
        "cycles": {"type": "integer", "minimum": 1, "maximum": 1000, "description": "Replay of scenes. Repeat the motion of the one body that has one, each time in another direction: the worst tick of a long run; ticks says how long"},
        "detectors": {"$ref": "#/$defs/methods", "description": "In a closed loop an entry that is an object may hold 'judged': false: its runs are timed and not judged; what truth says of a run that moves alike, bit by bit, is taken for them too"},
        "responses": {"$ref": "#/$defs/responses", "description": "Closed loop. An entry that is an object may hold 'detectors', 'contacts' and 'steppers': what it runs with instead of the experiment's"},
        "contacts": {"$ref": "#/$defs/contacts", "description": "Closed loop. Contact generators; absent: each response's own, as in trocar run. Generated scenes: detectors are asked for the pairs that the generator wants; absent: intersecting pairs"},
        "steppers": {"$ref": "#/$defs/steppers", "description": "Closed loop"},
        "against": {"type": "string", "minLength": 1, "description": "Closed loop. A second stepper, NAME[:key=value,...] as in trocar list, that runs every scene in step, with its own contacts: differences of tool force and places, near the first contact and far from it. Or twin: scenes with contact_off are held against themselves with contact at every tick, for how an interpenetration is resolved"},
        "sweep": {"type": "object", "additionalProperties": false, "required": ["knob", "values"], "description": "One parameter and its values: a curve of time against error for each scene and method",
          "properties": {
            "knob": {"type": "string", "description": "dt (s, the run keeps its length), k (N/m, contact stiffness), substeps, detector.KEY or response.KEY with a parameter of trocar list; in a replay detector.KEY only"},
            "values": {"type": "array", "minItems": 1, "items": {"type": ["number", "string"]}}}},
        "ticks": {"type": "integer", "minimum": 1, "description": "Instead of the scene's own number; p99 needs 1000, after the warm-up"},
        "repetitions": {"type": "integer", "minimum": 1, "description": "Instead of the study's; perturbed: 2 unless given, at least 2"},
        "truth_stride": {"type": "integer", "minimum": 0, "default": 1, "description": "Truth (pairs and depth) is computed on every n-th tick; it is never timed. 0: never; a closed loop then gives time per stage against tissue triangles, and scenes whose names differ behind the last underscore only are one curve"},
        "detail_stride": {"type": "integer", "minimum": 1, "default": 1, "description": "Closed loop. Of the judged ticks, every n-th is judged in detail too: near pairs missed, depth errors of contacts, overlap of closed bodies"},
        "between_ticks": {"type": "boolean", "default": false, "description": "Replay. Also ask the space-time oracle on every tick: contacts that begin between frames, events missed, onset latency"}}},
    "scenes": {"type": "array", "minItems": 1, "uniqueItems": true, "items": {"type": "string", "minLength": 1}, "description": "Files relative to the study; a name without a folder may be one that trocar scenes lists; one with *, ? or [...] stands for all that fit, as in a shell"},
    "methods": {"oneOf": [{"const": "all", "description": "Every method of trocar list, absent ones too"}, {"type": "array", "minItems": 1, "items": {"$ref": "#/$defs/method"}}]},
    "responses": {"oneOf": [{"const": "all", "description": "Every response of trocar list, absent ones too"}, {"type": "array", "minItems": 1, "items": {"anyOf": [{"$ref": "#/$defs/method"}, {"$ref": "#/$defs/tuned"}]}}]},
    "tuned": {"type": "object", "additionalProperties": false, "required": ["tuned"], "description": "The method at the setting that the file of the study's key 'tuned' has for it",
      "properties": {
         "tuned": {"type": "string", "minLength": 1, "description": "The method, as that file names it; its setting is that of the one stepper that it runs with"},
         "searched_with": {"type": "string", "minLength": 1, "description": "The stepper of the search, where the response runs with others"},
         "detectors": {"type": "array", "minItems": 1, "items": {"type": "string"}},
         "contacts": {"$ref": "#/$defs/contacts", "description": "Absent: the generator that the search found best"},
         "steppers": {"$ref": "#/$defs/steppers"},
         "scenes": {"$ref": "#/$defs/scenes"}}},
    "method": {"oneOf": [
      {"type": "string", "minLength": 1},
      {"type": "object", "additionalProperties": false, "required": ["method"],
       "properties": {
         "method": {"type": "string", "minLength": 1},
         "setting": {"enum": ["default", "recommended", "tuned"], "default": "default"},
         "reading_of": {"type": "string", "minLength": 1, "description": "Responses: the one of the list that this is at another value that its author leaves open; in place of setting and basis. Page 1 shows the range over the readings in the row of that one"},
         "most_triangles": {"type": "integer", "minimum": 1, "description": "Detectors on generated scenes: larger scenes are left out"},
         "judged": {"type": "boolean", "default": true, "description": "Detectors of a closed loop"},
         "detectors": {"type": "array", "minItems": 1, "items": {"type": "string"}, "description": "Responses"},
         "contacts": {"$ref": "#/$defs/contacts", "description": "Responses"},
         "steppers": {"$ref": "#/$defs/steppers", "description": "Responses: what the method is made for"},
         "basis": {"type": "string", "minLength": 1, "description": "Who recommends the setting, or how it was searched and with what budget; required unless default"},
         "scenes": {"$ref": "#/$defs/scenes", "description": "Those of the experiment's scenes that it runs on; default all"}}}]},
    "contacts": {"type": "array", "minItems": 1, "uniqueItems": true, "items": {"enum": ["native", "intersection", "proximity", "tracked_proximity"]}},
    "steppers": {"type": "array", "minItems": 1, "uniqueItems": true, "items": {"type": "string", "description": "NAME[:key=value,...] as in trocar list"}}
  }
}
)";
}

}  // namespace trocar
