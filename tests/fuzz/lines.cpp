// Lines of a gzip file that nobody wrote.
#include "fuzz_target.hpp"
#include "geometry/gzip.hpp"
#include "geometry/whole_file.hpp"

void trocar::fuzz::lines(std::string_view input) {
    const auto read = [](const std::filesystem::path& file) {
        std::string text;
        const auto stream = open_lines(file, "lines");
        for (std::string line; read_line(*stream, line, file.string());) {
            text += line;
            if (!stream->eof()) text += '\n';
        }
        return text;
    };
    std::string text;
    if (!taken([&] { text = read(as_file(input, "lines.gz")); })) return;
    const std::filesystem::path written = as_file(gzipped(text), "written.gz");
    expect(taken([&] { expect(read(written) == text, "what is written reads back the same"); }), "it can be read");
}
