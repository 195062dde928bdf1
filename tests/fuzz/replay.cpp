// Frames from outside through every detector that claims to be exact: whatever the mesh and wherever its vertices, all
// of them answer with the pairs that brute force finds.
#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "app/commands.hpp"
#include "fuzz_target.hpp"
#include "method/registry.hpp"
#include "scene/recording.hpp"

namespace trocar::fuzz {
namespace {

constexpr std::int64_t most_frames = 4;
constexpr Index most_triangles = 200;

struct Answer {
    OutcomeKind outcome = OutcomeKind::ok;
    bool truncated = false;
    std::vector<std::array<Index, 2>> pairs;
};

std::vector<Answer> answers_of(const std::string& detector_name, RecordingReader& reader) {
    const std::unique_ptr<Detector> detector = make_detector(detector_name);
    std::vector<Answer> answers;
    Frame frame;
    ContactSet contacts;
    for (std::int64_t tick = 0; tick < std::min(most_frames, reader.frame_count()); ++tick) {
        reader.read(tick, frame);
        if (tick == 0) detector->prepare(reader.topology(), frame);
        detector->update(frame, 0.0);
        detector->detect(frame, contacts);
        answers.push_back({.outcome = contacts.outcome.kind, .truncated = contacts.truncated, .pairs = {}});
        for (const TrianglePair& pair : contacts.pairs) answers.back().pairs.push_back({pair.a, pair.b});
    }
    return answers;
}

/// What a limit has cut is known to be incomplete.
bool agree(const Answer& one, const Answer& two) {
    return one.truncated || two.truncated || (one.outcome == two.outcome && one.pairs == two.pairs);
}

}  // namespace

void replay(std::string_view input) {
    const std::filesystem::path file = as_file(input, "frames.trocrec");
    taken([&] {
        RecordingReader reader(file);
        if (reader.topology().triangle_count() > most_triangles) return;
        const std::vector<Answer> truth = answers_of("brute_force", reader);
        for (const DetectorEntry& entry : registry().detectors()) {
            if (!entry.claims_exact || entry.control) continue;
            const std::vector<Answer> answers = answers_of(entry.name, reader);
            expect(std::equal(answers.begin(), answers.end(), truth.begin(), truth.end(), agree),
                   entry.name + " finds what brute force finds");
        }
        const int status = status_with_json(
            [&] { return app::replay({.json = true}, {.recording = file, .detector = "brute_force", .truth = true}); });
        expect(status == app::done || status == app::method_failed, "replay ends with status 0 or 3");
    });
}

}  // namespace trocar::fuzz
