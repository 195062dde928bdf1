// The volume constraint in a closed loop: an organ with a bulk modulus under a blunt shaft.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "method/registry.hpp"
#include "simulate/simulation.hpp"
#include "support/scene_samples.hpp"
#include "support/surfaces.hpp"

namespace trocar {
namespace {

struct Pressed {
    double volume_change = 0.0;  ///< 1, relative, at the last tick
    double force = 0.0;          ///< N, on the tool at the last tick
};

double volume_of(const Scene& scene, const Frame& frame, const BodyRange& body) {
    return test::signed_volume(
        {frame.position, scene.topology.triangles.middleCols(body.triangles.first, body.triangles.count)});
}

/// i2t_press_filled with another bulk modulus (Pa), until the shaft has stood for 250 ms.
Pressed press(double bulk_modulus) {
    nlohmann::json text = test::shipped_json("i2t_press_filled");
    text["bodies"][0]["tissue"]["bulk_modulus"] = bulk_modulus;
    const Scene scene = test::scene_from_text(text.dump());
    const BodyRange* organ = nullptr;
    for (const BodyRange& body : scene.topology.bodies) {
        if (body.kind == BodyKind::tissue) organ = &body;
    }
    const double before = volume_of(scene, scene.first, *organ);
    Simulation simulation(scene, make_detector("ohc_clustered", {}), make_response("unilateral", {}),
                          registry().contact_generator("tracked_proximity"));
    StepRow row;
    for (int tick = 0; tick < 550; ++tick) row = simulation.step();
    EXPECT_TRUE(simulation.outcome().ok()) << simulation.outcome().message;
    return {volume_of(scene, simulation.frame(), *organ) / before - 1.0, row.tool_force.norm()};
}

TEST(FilledOrgan, KeepsItsVolumeAndPressesBackHarderTheStifferItsVolumeIs) {
    const Pressed empty = press(0.0);
    const Pressed soft = press(2e3);
    const Pressed filled = press(100e3);
    EXPECT_LT(empty.volume_change, -0.01) << "the shaft takes volume from an empty organ";
    EXPECT_LT(empty.volume_change, soft.volume_change);
    EXPECT_LT(soft.volume_change, filled.volume_change);
    EXPECT_LT(filled.volume_change, 0.0) << "an over-pressure needs a loss";
    EXPECT_GT(filled.volume_change, 0.2 * empty.volume_change);
    EXPECT_GT(soft.force, 1.05 * empty.force);
    EXPECT_GT(filled.force, 1.2 * soft.force);
}

}  // namespace
}  // namespace trocar
