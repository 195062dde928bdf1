#include "scene/recording.hpp"

namespace trocar {

std::string recording_schema() {
    return R"({
  "$schema": "https://json-schema.org/draft/2020-12/schema",
  "title": "trocar recording, format TROCREC1",
  "description": "A little-endian file: 8 bytes TROCREC1; u64 H; H bytes of UTF-8 JSON (the header described here), padded with spaces so that H is a multiple of 8; triangles x 3 u32 global vertex numbers, zero-padded to a multiple of 8 bytes; then frames x vertices x 3 float64 positions (x y z of vertex 0, of vertex 1, ...). Nothing follows in a trocar-recording-1. The previous position of a frame is the frame before (frame 0: itself); velocity = (position - previous) / dt. After the frames of a trocar-recording-2, and of none else, follows UTF-8 text to the end of the file, each line ended by a line feed: first {\"format\":\"trocar-contacts-1\",\"ticks\":L}, then L lines as $defs/contacts_line describes, ascending by tick: the contacts that the recording's writer found. A non-finite position is that tick's outcome not_finite.",
  "type": "object",
  "additionalProperties": false,
  "required": ["format", "unit", "dt", "frames", "vertices", "triangles", "bodies"],
  "properties": {
    "format": {"enum": ["trocar-recording-1", "trocar-recording-2"], "description": "The second: contacts follow the frames"},
    "unit": {"const": "m"},
    "dt": {"type": "number", "exclusiveMinimum": 0, "unit": "s", "description": "Time between two frames"},
    "frames": {"type": "integer", "minimum": 0, "description": "F, number of frames"},
    "vertices": {"type": "integer", "minimum": 0, "maximum": 2147483647, "description": "N, vertices of all bodies"},
    "triangles": {"type": "integer", "minimum": 0, "maximum": 2147483647, "description": "T, triangles of all bodies"},
    "bodies": {
      "description": "Their ranges cover every vertex and every triangle once",
      "type": "array",
      "items": {
        "type": "object",
        "additionalProperties": false,
        "required": ["name", "kind", "closed", "vertices", "triangles"],
        "properties": {
          "name": {"type": "string", "minLength": 1, "description": "One of its own"},
          "kind": {"enum": ["instrument", "rigid", "tissue"]},
          "closed": {"type": "boolean", "description": "false: an open sheet, which has no inside"},
          "vertices": {"$ref": "#/$defs/range"},
          "triangles": {"$ref": "#/$defs/range"},
          "instrument": {"type": "string", "minLength": 1, "description": "Parts with the same name are not tested against each other"}}}},
    "body_pairs": {
      "description": "Pairs of body numbers (0-based) to test; default: every two bodies except rigid with rigid and parts of one instrument",
      "type": "array",
      "items": {"type": "array", "items": {"type": "integer", "minimum": 0}, "minItems": 2, "maxItems": 2}}
  },
  "$defs": {
    "range": {"type": "array", "items": {"type": "integer", "minimum": 0}, "minItems": 2, "maxItems": 2, "description": "[first, count]"},
    "vector": {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3, "description": "x y z, world"},
    "contacts_line": {
      "type": "object",
      "additionalProperties": false,
      "required": ["tick", "contacts"],
      "properties": {
        "tick": {"type": "integer", "minimum": 0, "description": "Number of the frame, from 0; a frame without a line is one without a report"},
        "contacts": {
          "description": "Empty: there were none. A pair of triangles may have several",
          "type": "array",
          "items": {
            "type": "object",
            "additionalProperties": false,
            "required": ["bodies", "triangles"],
            "properties": {
              "bodies": {"type": "array", "items": {"type": "string"}, "minItems": 2, "maxItems": 2, "description": "Names of two bodies that are tested against each other (body_pairs), in either order"},
              "triangles": {"type": "array", "items": {"type": "integer", "minimum": 0}, "minItems": 2, "maxItems": 2, "description": "Numbers in the file (0-based, over all bodies) of a triangle of each, in that order"},
              "point": {"$ref": "#/$defs/vector", "unit": "m"},
              "normal": {"$ref": "#/$defs/vector", "unit": "1", "description": "Of length 1 (to 1e-6), from the first body to the second"},
              "depth": {"type": "number", "unit": "m", "description": "Positive: inside by so much; negative: apart by so much"}}}}}}
  }
}
)";
}

}  // namespace trocar
