#include "fuzz_target.hpp"
#include "scene/external_frames.hpp"

void trocar::fuzz::external_data(std::string_view input) {
    taken([&] {
        const ExternalFrames data = read_fcl_scenario(as_file(input, "scenario.txt"));
        expect(data.topology.body_count() == 2 && !data.frames.empty(), "a scenario has two bodies and a pose");
    });
    taken([&] {
        for (const ContinuousQuery& query : read_ccd_queries(as_file(input, "queries.csv"))) {
            expect(query.start.frame.all_finite() && query.end.all_finite(), "points of a query are finite");
        }
    });
}
