// Answers of detectors on given frames, shared by `detect` and `replay`. Each detector runs in a child process, since a
// library may crash on what it is given. Its pairs are held against the exact oracle.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "contact/contact_set.hpp"
#include "measure/pair_truth.hpp"
#include "method/registry.hpp"
#include "scene/world.hpp"

namespace trocar::app {

/// One detector on one frame.
struct FrameAnswer {
    Outcome outcome = {};
    bool truncated = false;
    std::vector<TrianglePair> pairs = {};
    std::vector<Index> touch = {};  ///< positions in pairs
    std::vector<SweptContact> swept = {};
    std::int64_t update_ns = -1;  ///< below 0: nobody was timed
    std::int64_t detect_ns = -1;
    std::optional<PairErrors> errors = {};
};

struct DetectorAnswer {
    std::string name;
    bool claims_exact = false;
    Outcome outcome = {};  ///< the first that was not ok
    std::vector<FrameAnswer> frames = {};
};

/// The truth of every frame; none of one that holds a number that is not finite.
using Truths = std::vector<std::optional<TickTruth>>;

/// Frames that any number of detectors are asked about, by their number.
struct AskedFrames {
    const Topology& topology;
    std::int64_t count = 0;
    std::function<void(std::int64_t, Frame&)> read;
};

/// "all" (but controls), or one as parse_method reads it. Throws InputError for an unknown name and value.
std::vector<MethodSpec> detectors_named(const std::string& text);

/// Throws InputError unless `seconds` (--time-limit) is positive.
void check_time_limit(double seconds);

/// One update and detection in this process, by a prepared detector. `contacts` receives the answer. An exception
/// becomes the outcome `threw`.
FrameAnswer answer_here(Detector& detector, const Frame& frame, ContactSet& contacts);

/// One update and detection per frame, after preparation on the first finite one.
DetectorAnswer ask(const MethodSpec& method, const AskedFrames& frames, double time_limit_s);

/// Sorts the pairs and fills touch; with `truth`, errors. Then triangles get the numbers that `number` has for them.
void judge(const Topology& topology, const Frame& frame, const TickTruth* truth,
           const std::function<Index(Index)>& number, FrameAnswer& answer);

/// Reports on stderr who claims exactness and differs from the oracle. Adds to `all` detectors those that this build
/// lacks; of a single one reports how it failed. Returns the exit status.
int conclude(bool all, std::vector<DetectorAnswer>& answers);

/// Appends "pairs":[…],"touch":[…],"false_negatives":…,"false_positives":…,"update_ns":…,"detect_ns":… without braces;
/// null when absent. Millions of pairs are too many for a tree of JSON values.
void append_json(const FrameAnswer& answer, fmt::memory_buffer& text);

/// JSON string with quotes; invalid UTF-8 bytes are replaced.
std::string quoted_json(const std::string& text);

/// A row for each detector, with sums and medians over its frames. `truths` may be null.
void print_answers(const std::vector<DetectorAnswer>& answers, const Truths* truths);

}  // namespace trocar::app
