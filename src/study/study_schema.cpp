#include "study/study.hpp"

namespace trocar {

std::string study_schema() {
    return R"({
  "$schema": "https://json-schema.org/draft/2020-12/schema",
  "title": "trocar study, format trocar-study-2",
  "description": "What to compare. Every run is made in a process of its own with a time limit; a crash or a time-out is a row. Scene files are relative to the study file. A method is NAME[:key=value,...] as in trocar list; one that this build lacks becomes rows 'absent', an unknown one is bad input.",
  "type": "object",
  "additionalProperties": false,
  "required": ["format", "name"],
  "anyOf": [{"required": ["replay"]}, {"required": ["closed_loop"]}, {"required": ["work_precision"]}, {"required": ["paced"]}, {"required": ["cost_by_size"]}, {"required": ["hard_cases"]}, {"required": ["metamorphic"]}],
  "properties": {
    "format": {"const": "trocar-study-2"},
    "name": {"type": "string", "pattern": "^[A-Za-z0-9_-]+$", "description": "Names the folder of the report"},
    "seed": {"type": "integer", "minimum": 0, "default": 1, "description": "Order of the runs, and seed of everything random in a run"},
    "repetitions": {"type": "integer", "minimum": 1, "default": 1, "description": "Fresh processes per method; intervals are 95 % from 10 up, minimum to maximum below"},
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
    "ours": {"$ref": "#/$defs/method", "description": "Response of the closed loop that page one sets against the best of the others; absent: methods written by us against foreign ones"},
    "quotes": {"type": "string", "minLength": 1, "description": "A finding of another published report, with its name: page one repeats it"},
    "replay": {
      "description": "Every detector on the same frames: accuracy and speed of detection",
      "type": "object", "additionalProperties": false, "required": ["scenes", "detectors"],
      "properties": {
        "scenes": {"$ref": "#/$defs/scenes"}, "detectors": {"$ref": "#/$defs/methods"},
        "ticks": {"$ref": "#/$defs/ticks"}, "repetitions": {"$ref": "#/$defs/repetitions"},
        "truth_stride": {"$ref": "#/$defs/truth_stride"},
        "between_ticks": {"type": "boolean", "default": false, "description": "Also ask the space-time oracle on every tick: contacts that begin between frames, events missed, onset latency"}}},
    "closed_loop": {
      "description": "Every detector with every response and contact generator, each driving its own copy of the scene",
      "type": "object", "additionalProperties": false, "required": ["scenes", "detectors", "responses"],
      "properties": {
        "scenes": {"$ref": "#/$defs/scenes"},
        "detectors": {"$ref": "#/$defs/methods", "description": "An entry that is an object may also hold 'judged': false, its runs are timed and not judged; what truth says of a run that moves alike, bit by bit, is taken for them too"},
        "responses": {"$ref": "#/$defs/methods", "description": "An entry that is an object may also hold 'detectors' and 'contacts': those of the part's that it runs with; default all"},
        "contacts": {"type": "array", "minItems": 1, "uniqueItems": true, "default": ["tracked_proximity"], "items": {"enum": ["native", "intersection", "proximity", "tracked_proximity"]}, "description": "Absent, a response that cannot work from tracked_proximity contacts runs on its own generator, as in trocar run"},
        "steppers": {"type": "array", "minItems": 1, "uniqueItems": true, "default": ["semi_implicit"], "items": {"type": "string", "description": "NAME[:key=value,...] as in trocar list"}},
        "ticks": {"$ref": "#/$defs/ticks"}, "repetitions": {"$ref": "#/$defs/repetitions"},
        "truth_stride": {"$ref": "#/$defs/truth_stride"},
        "detail_stride": {"type": "integer", "minimum": 1, "default": 1, "description": "Of the judged ticks, every n-th is judged in detail too: near pairs missed, depth errors of contacts, overlap of closed bodies"}}},
    "work_precision": {
      "description": "One knob turned at a time: a curve of time against error for each scene and method. Records of these runs hold no single ticks",
      "type": "object", "additionalProperties": false, "required": ["sweeps"],
      "properties": {
        "sweeps": {"type": "array", "minItems": 1, "items": {
          "type": "object", "additionalProperties": false, "required": ["scenes", "detectors", "knob", "values"],
          "properties": {
            "scenes": {"$ref": "#/$defs/scenes"}, "detectors": {"$ref": "#/$defs/methods"},
            "responses": {"$ref": "#/$defs/methods", "description": "Absent: the detectors on replayed frames"},
            "contacts": {"enum": ["native", "intersection", "proximity", "tracked_proximity"], "description": "Absent: each response's own, as in trocar run"},
            "knob": {"type": "string", "description": "dt (s, the run keeps its length), k (N/m, contact stiffness), substeps, detector.KEY or response.KEY with a parameter of trocar list"},
            "values": {"type": "array", "minItems": 1, "items": {"type": ["number", "string"]}}}}},
        "ticks": {"$ref": "#/$defs/ticks"}, "repetitions": {"$ref": "#/$defs/repetitions"},
        "truth_stride": {"$ref": "#/$defs/truth_stride"}}},
    "paced": {
      "description": "The closed loop released by the clock, one tick per dt of the scene, beside an empty loop; takes as long as it simulates, twice. Not judged. Records of these runs hold no single ticks",
      "type": "object", "additionalProperties": false, "required": ["scenes", "detectors", "responses"],
      "properties": {
        "scenes": {"$ref": "#/$defs/scenes"}, "detectors": {"$ref": "#/$defs/methods"},
        "responses": {"$ref": "#/$defs/methods"},
        "steppers": {"type": "array", "minItems": 1, "uniqueItems": true, "default": ["semi_implicit"], "items": {"type": "string", "description": "NAME[:key=value,...] as in trocar list"}},
        "ticks": {"$ref": "#/$defs/ticks"}, "repetitions": {"$ref": "#/$defs/repetitions"}}},
    "cost_by_size": {
      "description": "What a tick costs against the number of tissue triangles, stages apart: the closed loop on scenes that grow, back to back and not judged. Scenes whose names differ behind the last underscore only are one family and one curve. Records of these runs hold no single ticks",
      "type": "object", "additionalProperties": false, "required": ["scenes", "detectors", "responses"],
      "properties": {
        "scenes": {"$ref": "#/$defs/scenes"}, "detectors": {"$ref": "#/$defs/methods"},
        "responses": {"$ref": "#/$defs/methods"},
        "steppers": {"type": "array", "minItems": 1, "uniqueItems": true, "default": ["semi_implicit"], "items": {"type": "string", "description": "NAME[:key=value,...] as in trocar list"}},
        "ticks": {"$ref": "#/$defs/ticks"}, "repetitions": {"$ref": "#/$defs/repetitions"}}},
    "hard_cases": {
      "description": "The hard-case matrix: every detector on every case of meshes and family of triangle pairs, every response (on the contacts of the first detector) on every case that is a scene. Records of these runs hold no single ticks",
      "type": "object", "additionalProperties": false, "required": ["folder", "detectors"],
      "properties": {
        "folder": {"type": "string", "minLength": 1, "description": "Folder of cases, each a folder with expected.json; relative to the study file"},
        "families": {"type": "array", "minItems": 1, "items": {"type": "string", "pattern": "^data:"}, "description": "Files of triangle pairs with truth, as `trocar tritri` reads them; without the data folder they become rows 'unsupported (no data)'"},
        "detectors": {"$ref": "#/$defs/methods"}, "responses": {"$ref": "#/$defs/methods"},
        "truth_stride": {"$ref": "#/$defs/truth_stride"}}},
    "metamorphic": {
      "description": "Metamorphic test of determinism: the same question asked twice, in a fresh process, with triangles and bodies in another order, a pair swapped, the origin moved, lengths in millimetres. Detectors on about 20 frames of each scene, responses (on the contacts of the first detector) in the closed loop. Records of these runs hold no single ticks",
      "type": "object", "additionalProperties": false, "required": ["scenes", "detectors"],
      "properties": {
        "scenes": {"$ref": "#/$defs/scenes"}, "detectors": {"$ref": "#/$defs/methods"},
        "responses": {"$ref": "#/$defs/methods"}, "ticks": {"$ref": "#/$defs/ticks"},
        "repetitions": {"type": "integer", "minimum": 2, "default": 2, "description": "Fresh processes"}}}
  },
  "$defs": {
    "scenes": {"type": "array", "minItems": 1, "uniqueItems": true, "items": {"type": "string", "minLength": 1}, "description": "Files relative to the study; a name without a folder may be one that trocar scenes lists; one with *, ? or [...] stands for all that fit, as in a shell"},
    "methods": {"oneOf": [{"const": "all", "description": "Every method of trocar list, absent ones too"}, {"type": "array", "minItems": 1, "items": {"$ref": "#/$defs/method"}}]},
    "method": {"oneOf": [
      {"type": "string", "minLength": 1},
      {"type": "object", "additionalProperties": false, "required": ["method"],
       "properties": {
         "method": {"type": "string", "minLength": 1},
         "setting": {"enum": ["default", "recommended", "tuned"], "default": "default"},
         "judged": {"type": "boolean", "default": true, "description": "Closed loop, detectors"},
         "detectors": {"type": "array", "minItems": 1, "items": {"type": "string"}, "description": "Closed loop, responses"},
         "contacts": {"type": "array", "minItems": 1, "items": {"type": "string"}, "description": "Closed loop, responses"},
         "steppers": {"type": "array", "minItems": 1, "uniqueItems": true, "items": {"type": "string"}, "description": "Closed loop, responses: instead of the part's, what the method is made for"},
         "basis": {"type": "string", "minLength": 1, "description": "Who recommends the setting, or how it was searched and with what budget; required unless default"},
         "scenes": {"$ref": "#/$defs/scenes", "description": "In lists of detectors and responses: those of the part's scenes it runs on; default all"}}}]},
    "ticks": {"type": "integer", "minimum": 1, "description": "Instead of the scene's own number; p99 needs 1000, after the warm-up"},
    "repetitions": {"type": "integer", "minimum": 1, "description": "Instead of the study's"},
    "truth_stride": {"type": "integer", "minimum": 1, "default": 1, "description": "Truth (pairs and depth) is computed on every n-th tick; it is never timed"}
  }
}
)";
}

}  // namespace trocar
