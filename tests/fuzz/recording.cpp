#include "scene/recording.hpp"

#include <algorithm>

#include "fuzz_target.hpp"

void trocar::fuzz::recording(std::string_view input) {
    const std::filesystem::path file = as_file(input, "frames.trocrec");
    taken([&] {
        RecordingReader reader(file);
        constexpr std::int64_t most = 100;
        Frame frame;
        for (std::int64_t tick = 0; tick < std::min(most, reader.frame_count()); ++tick) {
            reader.read(tick, frame);
            expect(frame.position.cols() == reader.topology().vertex_count, "every vertex has a position");
        }
    });
}
