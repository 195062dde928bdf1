#include "fuzz_target.hpp"
#include "playback/frame_series.hpp"

void trocar::fuzz::frames(std::string_view input) {
    taken([&] {
        const auto series = frame_series({as_file(input, "frames.npz")},
                                         {.unit = 1.0, .frame_time = not_known, .bodies = BodyRule::given});
        Frame frame;
        while (series->next(frame)) expect(frame.all_finite(), "positions of a frame are finite");
    });
}
