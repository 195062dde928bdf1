#include "fuzz_target.hpp"
#include "study/baseline_comparison.hpp"
#include "study/contact_baseline.hpp"

void trocar::fuzz::baseline(std::string_view input) {
    ContactBaseline baseline;
    if (!taken([&] { baseline = contact_baseline_from_json(std::string(input), "input"); })) return;
    for (auto& [name, answer] : baseline.detectors) {
        const AnswerDifference none = compare_answers(answer, answer, {});
        expect(none.missing == 0 && none.extra == 0 && none.worst_depth == 0.0, "an answer equals itself");
        for (const auto& [other_name, other] : baseline.detectors) {
            static_cast<void>(compare_answers(answer, other, {}));
        }
        round_like_stored(answer);
    }
    static_cast<void>(to_json(baseline));
}
