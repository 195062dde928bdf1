#include "view/page.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <random>

#include "support/scene_samples.hpp"
#include "view/view_data.hpp"
#include "web/web.hpp"

namespace trocar {
namespace {

/// A run whose every vertex wanders without a pattern: what compresses worst.
ViewPage noisy_page(std::int64_t frames) {
    const Scene scene = test::scene_from_text(test::poke_text());
    ViewPage page;
    page.scene = "noise";
    page.topology = scene.topology;
    page.rest = scene.first.position;
    page.ticks = 8 * frames;
    ViewedRun& run = page.runs.emplace_back();
    run.label = "noise";
    std::mt19937 random(5);
    std::normal_distribution<double> wander(0.0, 0.01);
    for (std::int64_t k = 0; k < frames; ++k) {
        ViewedFrame& frame = run.frames.emplace_back();
        frame.tick = 8 * k;
        frame.position = scene.first.position.unaryExpr([&](double x) { return x + wander(random); });
        frame.depth.assign(tissue_vertices(scene.topology).size(), 0.0);
        frame.strain = frame.depth;
    }
    for (std::int64_t tick = 0; tick < page.ticks; ++tick) {
        run.depth.push_back(1e-3);
        run.force.emplace_back(0.0, 0.0, 1.0);
        run.contacts.push_back(1);
    }
    run.worst_depth = {8 * 3, 1e-3};
    run.worst_force = {8 * 5, 1.0};
    return page;
}

TEST(ViewPage, StaysWithinItsBoundAndLeavesOutFramesButNotTheWorst) {
    const ViewPage page = noisy_page(400);
    const std::string html = view_html(page, "");
    EXPECT_LE(html.size(), view_file_bound);
    const nlohmann::json data = test::view_data(html);
    EXPECT_LE(data.dump().size(), view_page_budget);
    const auto frames = data["runs"][0]["frames"].get<std::vector<std::int64_t>>();
    EXPECT_LT(frames.size(), 400U);
    for (const std::int64_t tick : {8 * 3, 8 * 5, 8 * 399}) {
        EXPECT_NE(std::find(frames.begin(), frames.end(), tick), frames.end()) << "tick " << tick;
    }
    std::int64_t gap = 0;
    for (std::size_t k = 1; k < frames.size(); ++k) gap = std::max(gap, frames[k] - frames[k - 1]);
    EXPECT_NE(data["foot"].get<std::string>().find(std::to_string(gap) + " ticks"), std::string::npos) << data["foot"];
}

TEST(ViewPage, WithoutNeedNoFrameIsLeftOut) {
    const nlohmann::json data = test::view_data(view_html(noisy_page(4), ""));
    EXPECT_EQ(data["runs"][0]["frames"], (std::vector<std::int64_t>{0, 8, 16, 24}));
}

TEST(ViewPage, ScriptsFitBesideTheLargestPage) {
    EXPECT_LE(web::viewer_script().size() + view_page_budget + 2000, view_file_bound);
    for (const std::string_view script : {web::viewer_script(), web::charts_script()}) {
        EXPECT_EQ(script.find("</script"), std::string_view::npos) << "would end the element that holds it";
        EXPECT_EQ(script.find("<!--"), std::string_view::npos) << "would hide the rest of the page";
    }
    EXPECT_NE(web::viewer_script().find("trocarViewer"), std::string_view::npos);
    EXPECT_NE(web::charts_script().find("trocarCharts"), std::string_view::npos);
}

TEST(ViewPage, NamesOfUsersAreNoMarkup) {
    ViewPage page = noisy_page(2);
    page.scene = "</script><b>&\"";
    page.runs[0].label = "</script><script>alert(1)</script>";
    const std::string html = view_html(page, "viewer.js");
    EXPECT_EQ(html.find("</script><b>"), std::string::npos);
    EXPECT_EQ(html.find("<script>alert"), std::string::npos);
    EXPECT_EQ(test::view_data(html)["scene"], page.scene);
    EXPECT_NE(html.find("<script src=\"viewer.js\"></script>"), std::string::npos);
}

TEST(ViewPage, ARunThatFliesAwayIsReportedAndCostsNoPrecision) {
    ViewPage page = noisy_page(3);
    const double before = view_error_bound(page);
    page.runs.push_back(page.runs.front());
    page.runs.back().label = "flies";
    page.runs.back().frames.back().position.col(0).setConstant(1e9);
    EXPECT_LE(view_error_bound(page), 4.0 * before);
    const nlohmann::json notes = test::view_data(view_html(page, ""))["notes"];
    ASSERT_EQ(notes.size(), 1U);
    EXPECT_EQ(notes[0].get<std::string>().rfind("flies:", 0), 0U);
}

}  // namespace
}  // namespace trocar
