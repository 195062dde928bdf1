#include "app/pair_answer.hpp"

#include <fmt/ranges.h>

#include <iterator>
#include <nlohmann/json.hpp>

namespace trocar::app {

void append_json(const PairAnswer& answer, fmt::memory_buffer& text) {
    const auto out = std::back_inserter(text);
    fmt::format_to(out, "\"pairs\":[");
    for (std::size_t k = 0; k < answer.pairs.size(); ++k) {
        fmt::format_to(out, "{}[{},{}]", k > 0 ? "," : "", answer.pairs[k].a, answer.pairs[k].b - answer.first_of_b);
    }
    fmt::format_to(out, "],\"touch\":[{}]", fmt::join(answer.touch, ","));
    const auto number = [](bool known, std::int64_t value) { return known ? fmt::format("{}", value) : "null"; };
    fmt::format_to(out, ",\"false_negatives\":{},\"false_positives\":{},\"update_ns\":{},\"detect_ns\":{}",
                   number(answer.errors.has_value(), answer.errors ? answer.errors->false_negatives : 0),
                   number(answer.errors.has_value(), answer.errors ? answer.errors->false_positives : 0),
                   number(answer.update_ns.has_value(), answer.update_ns.value_or(0)),
                   number(answer.detect_ns.has_value(), answer.detect_ns.value_or(0)));
}

std::string quoted_json(const std::string& text) {
    return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace trocar::app
