// What a replay page holds, as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace trocar::test {

inline nlohmann::json view_data(const std::string& html) {
    const std::string start = "type=\"application/json\">";
    const std::size_t from = html.find(start);
    if (from == std::string::npos) return {};
    const std::size_t to = html.find("</script>", from);
    return nlohmann::json::parse(html.substr(from + start.size(), to - from - start.size()), nullptr, false);
}

}  // namespace trocar::test
