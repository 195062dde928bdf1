// A small recording assembled byte by byte from the format's description, independent of the library's writer.
#pragma once

#include <cstdint>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace trocar::test {

/// Two triangles in two bodies (a: open tissue; b: instrument) over three frames. Tests modify the members before
/// bytes().
struct RecordingText {
    std::string magic = "TROCREC1";
    nlohmann::ordered_json header = nlohmann::ordered_json::parse(R"({"format":"trocar-recording-1","unit":"m",
        "dt":0.5,"frames":3,"vertices":6,"triangles":2,"bodies":[
        {"name":"a","kind":"tissue","closed":false,"vertices":[0,3],"triangles":[0,1]},
        {"name":"b","kind":"instrument","closed":true,"vertices":[3,3],"triangles":[1,1]}]})");
    std::vector<std::uint32_t> triangles{0, 1, 2, 3, 4, 5};
    std::vector<double> positions = default_positions();
    std::string tail;

    static double coordinate(int frame, int vertex, int axis) { return frame + 0.1 * vertex + 0.013 * axis * axis; }
    static std::vector<double> default_positions() {
        std::vector<double> numbers;
        for (int frame = 0; frame < 3; ++frame) {
            for (int vertex = 0; vertex < 6; ++vertex) {
                for (int axis = 0; axis < 3; ++axis) numbers.push_back(coordinate(frame, vertex, axis));
            }
        }
        return numbers;
    }

    [[nodiscard]] std::string bytes() const {
        std::string text = header.dump();
        while (text.size() % 8 != 0) text.push_back(' ');
        const std::uint64_t length = text.size();
        std::string result = magic;
        result.append(reinterpret_cast<const char*>(&length), 8);
        result += text;
        result.append(reinterpret_cast<const char*>(triangles.data()), triangles.size() * 4);
        while (result.size() % 8 != 0) result.push_back('\0');
        result.append(reinterpret_cast<const char*>(positions.data()), positions.size() * 8);
        return result + tail;
    }
};

/// Triangle a in z = 0 in every frame; b stands with one corner at the frame's height above it.
inline RecordingText standing_at(const std::vector<double>& heights) {
    RecordingText text;
    text.header["frames"] = heights.size();
    text.positions.clear();
    for (const double low : heights) {
        text.positions.insert(text.positions.end(), {0, 0, 0, 1, 0, 0, 0, 1, 0});
        text.positions.insert(text.positions.end(), {0.25, 0.25, low, 0.25, 0.25, 2, 0.5, 0.25, 2});
    }
    return text;
}

}  // namespace trocar::test
