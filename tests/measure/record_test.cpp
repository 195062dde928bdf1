#include "measure/record.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

#include "geometry/fnv_hash.hpp"
#include "geometry/json_depth.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

Record sample() {
    Record record;
    record.spec = {.study = "default",
                   .mode = "closed_loop",
                   .scene = "i2t_poke",
                   .scene_file = "../../scenes/i2t_poke.json",
                   .scene_hash = "00ff00ff00ff00ff",
                   .pair_class = "I2T",
                   .detector = "some:bv=AABB",
                   .response = "other",
                   .contacts = "intersection",
                   .setting = "tuned",
                   .repetition = 3,
                   .seed = 0xFFFFFFFFFFFFFFFFULL,
                   .ticks = 500,
                   .truth_stride = 7};
    record.spec.stepper = "other:h=2";
    record.spec.device = "tip=sum,saturation=3";
    record.spec.overrides = "dt=0.0005";
    record.spec.knob = "dt";
    record.spec.point = "0.0005";
    record.environment = {{"cpu", "a \"quoted\" name"}, {"dirty", "no"}};
    record.outcome = {OutcomeKind::unstable, "blew up at tick 219"};
    record.frames_hash = "0123456789abcdef";
    record.state_hash = "fedcba9876543210";
    record.summary = {{Metric::recall, 1.0 / 3.0}, {Metric::force_error_rms_hard, std::nan("")}};
    for (int i = 0; i < 3; ++i) {
        StepRow row;
        row.tick = i;
        row.time = 0.1 * i;
        row.stage_ns = {10 + i, 20, 30, 40, -1, -1};
        row.pairs = 5;
        row.residual_penetration = std::nextafter(1e-3, 1.0);
        row.overlap_volume = 1e-9 * i;
        row.overshoot = 0.25;
        row.tool_force = Vector3(1e-300, -0.0, 0.1 + 0.2);
        row.work.cells_visited = 7;
        row.truncated = i == 1;
        row.outcome = i == 2 ? OutcomeKind::unstable : OutcomeKind::ok;
        record.rows.push_back(row);
    }
    return record;
}

void expect_same_bits(double a, double b) {
    if (std::isnan(a) && std::isnan(b)) return;
    EXPECT_EQ(std::bit_cast<std::uint64_t>(a), std::bit_cast<std::uint64_t>(b)) << a << " " << b;
}

TEST(RecordLine, ReadsBackBitForBit) {
    const Record record = sample();
    const std::string line = to_json_line(record);
    EXPECT_EQ(line.find('\n'), std::string::npos);
    const Record back = record_from_json_line(line, "records.jsonl", 1);
    EXPECT_EQ(to_json_line(back), line);
    EXPECT_EQ(back.spec.seed, record.spec.seed);
    EXPECT_EQ(back.spec.truth_stride, 7);
    EXPECT_EQ(back.spec.response, "other");
    EXPECT_EQ(back.spec.stepper, "other:h=2");
    EXPECT_EQ(back.spec.device, "tip=sum,saturation=3");
    EXPECT_EQ(back.spec.overrides, "dt=0.0005");
    EXPECT_EQ(back.spec.knob, "dt");
    EXPECT_EQ(back.spec.point, "0.0005");
    EXPECT_EQ(back.environment, record.environment);
    EXPECT_EQ(back.outcome.kind, OutcomeKind::unstable);
    EXPECT_EQ(back.outcome.message, record.outcome.message);
    EXPECT_EQ(back.state_hash, record.state_hash);
    expect_same_bits(back.summary.at(Metric::recall), 1.0 / 3.0);
    EXPECT_TRUE(std::isnan(back.summary.at(Metric::force_error_rms_hard)));
    ASSERT_EQ(back.rows.size(), 3U);
    for (std::size_t i = 0; i < 3; ++i) {
        const StepRow& a = record.rows[i];
        const StepRow& b = back.rows[i];
        EXPECT_EQ(b.tick, a.tick);
        EXPECT_EQ(b.stage_ns, a.stage_ns);
        expect_same_bits(b.overlap_volume, a.overlap_volume);
        expect_same_bits(b.overshoot, a.overshoot);
        EXPECT_EQ(b.work.cells_visited, 7);
        EXPECT_EQ(b.truncated, a.truncated);
        EXPECT_EQ(b.outcome, a.outcome);
        EXPECT_EQ(b.true_pairs, -1);
        expect_same_bits(b.time, a.time);
        expect_same_bits(b.residual_penetration, a.residual_penetration);
        expect_same_bits(b.depth_error, a.depth_error);
        for (int axis = 0; axis < 3; ++axis) expect_same_bits(b.tool_force[axis], a.tool_force[axis]);
    }
}

TEST(RunId, IsTheHashOfTheStoredSpecificationAlone) {
    Record record = sample();
    record.spec.detail_stride = 3;
    record.spec.between_ticks = true;
    FnvHash hash;
    hash.add_text(nlohmann::ordered_json::parse(to_json_line(record)).at("spec").dump());
    EXPECT_EQ(run_id(record.spec), hash.text());
    EXPECT_EQ(run_id(record_from_json_line(to_json_line(record), "f", 1).spec), hash.text());
    RunSpec other = record.spec;
    ++other.repetition;
    EXPECT_NE(run_id(other), hash.text());
    other = record.spec;
    other.between_ticks = false;
    EXPECT_NE(run_id(other), hash.text());
}

TEST(RecordLine, NonFiniteNumbersBecomeNullAndNaN) {
    Record record = sample();
    record.rows[0].residual_penetration = std::numeric_limits<double>::infinity();
    const std::string line = to_json_line(record);
    EXPECT_NE(line.find("\"residual_penetration\":[null,"), std::string::npos) << line;
    EXPECT_TRUE(std::isnan(record_from_json_line(line, "f", 1).rows[0].residual_penetration));
}

TEST(RecordLine, RunWithoutRowsReadsBack) {
    Record record = sample();
    record.rows.clear();
    const std::string line = to_json_line(record);
    EXPECT_TRUE(record_from_json_line(line, "f", 1).rows.empty());
}

TEST(RecordLine, BytesThatAreNoTextDoNotBreakIt) {
    Record record = sample();
    record.outcome.message = "library said \xff";
    // Unicode's replacement character, U+FFFD, in place of the byte.
    EXPECT_EQ(record_from_json_line(to_json_line(record), "f", 1).outcome.message, "library said \xef\xbf\xbd");
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
}

/// With file and line, and `place` in the message.
void expect_refused(const std::string& line, const std::string& place) {
    const std::string what = test::complaint_of([&] { record_from_json_line(line, "records.jsonl", 12); });
    EXPECT_EQ(what.find("records.jsonl: line 12"), 0U) << what << line;
    EXPECT_NE(what.find(place), std::string::npos) << what;
}

TEST(RecordLine, BadRecordIsRefusedWithFileLineAndPlace) {
    const std::string line = to_json_line(sample());
    const struct {
        std::string text;
        std::string place;
    } cases[] = {
        {line.substr(0, line.size() / 2), "byte"},
        {"[1,2]", "object"},
        {replaced(line, "\"repetition\":3", "\"repetition\":\"3\""), "/spec/repetition"},
        {replaced(line, "\"repetition\":3,", ""), "/spec/repetition"},
        {replaced(line, "\"repetition\":3", "\"repetition\":3,\"false_positives\":1"), "false_positives"},
        {replaced(line, "\"pairs\":[5,5,5]", "\"pairs\":[5,5]"), "/rows/pairs"},
        {replaced(line, "\"pairs\":[5,5,5]", "\"pairs\":[5,null,5]"), "/rows/pairs/1"},
        {replaced(line, "\"pairs\":", "\"pears\":"), "pears"},
        {replaced(line, "\"outcome\":\"unstable\"", "\"outcome\":\"fine\""), "/outcome"},
        {replaced(line, "\"summary\":{", "\"summary\":{\"paced_hits\":1,"), "/summary/paced_hits"},
        // Texts that whoever reads the record takes as numbers.
        {replaced(line, "\"dirty\":\"no\"", "\"run.tissue_triangles\":\"2000 or so\""), "run.tissue_triangles"},
        {replaced(line, "\"dirty\":\"no\"", "\"case.at_most.residual_penetration_max_m\":\"nan\""),
         "case.at_most.residual_penetration_max_m"},
    };
    for (const auto& bad : cases) expect_refused(bad.text, bad.place);
}

TEST(RecordJson, ColumnsThatAShortTextMakesLongAreRefusedWithTheFigure) {
    std::string line = to_json_line(Record());
    const std::string none = "\"rows\":{\"count\":0}";
    const std::size_t at = line.find(none);
    ASSERT_NE(at, std::string::npos) << line;
    const auto of_rows = [&](int count) {
        std::string longer = line;
        return longer.replace(at, none.size(), fmt::format("\"rows\":{{\"count\":{},\"pairs\":{{\"all\":1}}}}", count));
    };
    EXPECT_EQ(record_from_json_line(of_rows(2000), "file", 1).rows.size(), 2000U);
    expect_refused(of_rows(400'001), "at most 400000 ticks of a record (--large lifts this), got 400001");
}

TEST(JsonDepth, CountsWhatIsOpenAtATimeOutsideOfTexts) {
    const auto lists = [](std::size_t levels) { return std::string(levels, '[') + std::string(levels, ']'); };
    EXPECT_FALSE(is_nested_too_deep(lists(100)));
    EXPECT_TRUE(is_nested_too_deep(lists(101)));
    EXPECT_FALSE(is_nested_too_deep("[" + lists(99) + "," + lists(99) + "]"));
    EXPECT_TRUE(is_nested_too_deep("[{\"a\":" + lists(99) + "}]"));
    EXPECT_FALSE(is_nested_too_deep("[{\"" + std::string(200, '[') + "\\\"" + std::string(200, '{') + "\":1}]"));
    EXPECT_TRUE(is_nested_too_deep("\"\\\\\"" + lists(101))) << "the text ends after an escaped backslash";
    EXPECT_TRUE(is_nested_too_deep(std::string(101, '[')));
}

TEST(RecordJson, ShortColumnsReadBackTheSame) {
    for (const std::size_t count : {1U, 7U, 8U, 9U, 10U, 31U}) {
        for (const std::size_t every : {1U, 2U, 3U, 5U}) {
            Record record;
            for (std::size_t i = 0; i < count; ++i) {
                StepRow row;
                row.tick = static_cast<std::int64_t>(i) + 7;
                row.pairs = 3;
                row.contacts_offered = static_cast<std::int64_t>(i * i);
                if (i % every == 0 || i + 1 == count) row.residual_penetration = 0.5 + static_cast<double>(i);
                record.rows.push_back(row);
            }
            const std::string line = to_json_line(record);
            const Record back = record_from_json_line(line, "file", 1);
            ASSERT_EQ(back.rows.size(), count);
            for (std::size_t i = 0; i < count; ++i) {
                EXPECT_EQ(back.rows[i].tick, record.rows[i].tick);
                EXPECT_EQ(back.rows[i].pairs, 3);
                EXPECT_EQ(back.rows[i].contacts_offered, record.rows[i].contacts_offered);
                EXPECT_EQ(std::isnan(back.rows[i].residual_penetration),
                          std::isnan(record.rows[i].residual_penetration))
                    << i;
                if (!std::isnan(record.rows[i].residual_penetration)) {
                    EXPECT_EQ(back.rows[i].residual_penetration, record.rows[i].residual_penetration);
                }
            }
            EXPECT_EQ(to_json_line(back), line);
        }
    }
}

}  // namespace
}  // namespace trocar
