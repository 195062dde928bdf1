// The section about what happens between frames says what the records' events say, and nothing where there are none.
#include <gtest/gtest.h>

#include <cmath>

#include "report/report.hpp"
#include "support/text.hpp"
#include "synthetic.hpp"

namespace trocar {
namespace {

/// A replay of 1 ms ticks with four contacts of a quarter of a tick, of which the first `missed` were never reported.
Record replay(const std::string& detector, int missed) {
    Record record = test::synthetic({.mode = "replay", .detector = detector, .residual_mm = std::nan("")});
    record.spec.between_ticks = true;
    for (std::size_t i = 0; i < record.rows.size(); ++i) {
        record.rows[i].tick = static_cast<std::int64_t>(i);
        record.rows[i].time = 0.001 * static_cast<double>(i);
    }
    for (int k = 0; k < 4; ++k) {
        ContactEvent event{.body_a = 0, .body_b = 1, .begin = 0.01 * k + 0.0001, .end = 0.01 * k + 0.00035};
        if (k >= missed) event.seen = 0.01 * k + 0.001;
        record.events.push_back(event);
    }
    record.summary[Metric::contact_events] = 4.0;
    record.summary[Metric::contact_events_missed] = missed;
    record.summary[Metric::onset_latency_median_s] = 0.00025;
    record.summary[Metric::onset_latency_max_s] = 0.0009;
    return record;
}

TEST(BetweenTicksSection, ReportsTheShareMissedBesideTheChanceOfOneLookPerTick) {
    const std::string report = test::whole(make_report({replay("searches", 3), replay("follows", 0)}));
    EXPECT_NE(report.find("## Between the ticks"), std::string::npos);
    EXPECT_NE(report.find("| `searches` | 4 | 3 | 250 | 900 |"), std::string::npos) << "latencies in µs";
    EXPECT_NE(report.find("| `follows` | 4 | 0 |"), std::string::npos);
    // v·dt / thickness = 4: by chance 1 - 1/4 are missed.
    test::expect_holds(report, {"| one sample per tick, by chance | 0.750 |", "| `searches` | 0.750 |",
                                "| `follows` | 0 |", "charts/between_ticks_"});
}

TEST(BetweenTicksSection, WhoMissesContactsBetweenFramesDoesNotComeFirstForBeingFast) {
    Record fast = replay("searches", 3);
    fast.summary[Metric::total_median_ns] = 1.0;
    const Report report = make_report({fast, replay("follows", 0)});
    test::expect_holds(test::whole(report),
                       {"| `follows` | 0 of 4440 | 0 | 0 of 4 |", "| 1 | `follows` | 0 / 0 of 4440 | 0 of 4 |",
                        "| 2 | `searches` | 0 / 0 of 4440 | 3 of 4 |",
                        "`follows` missed 0 and added 0 of 4440 pairs and missed 0 of 4 contacts between frames"});
    EXPECT_NE(report.page_one.find("missed between frames"), std::string::npos);
}

TEST(BetweenTicksSection, NoNameOfASceneLeadsItsChartOutOfTheFolder) {
    Record record = replay("searches", 3);
    record.spec.scene = "../../elsewhere";
    const Report report = make_report({record});
    bool drawn = false;
    for (const auto& [file, content] : report.files) {
        EXPECT_EQ(file.find(".."), std::string::npos) << file;
        drawn = drawn || file.find("______elsewhere") != std::string::npos;
    }
    EXPECT_TRUE(drawn);
}

}  // namespace
}  // namespace trocar
