#include "scene/retired_names.hpp"

#include <array>

namespace trocar {
namespace {

constexpr std::string_view of_profile = "it belongs to the profile, profile=faithful, corrected or printed";
constexpr std::string_view of_unilateral = "take the response unilateral";

/// Kind, scope, retired name, use. Name and use have at most 120 bytes together, so that long messages keep them.
constexpr auto retired = std::to_array<RetiredName>({
    {NameKind::response, "", "hold", "renamed to 'unilateral'"},
    {NameKind::response, "", "xpbd", "renamed to 'xpbd_contact'"},
    {NameKind::contact_generator, "", "canonical", "renamed to 'intersection'"},
    {NameKind::contact_generator, "", "near", "renamed to 'proximity'"},
    {NameKind::contact_generator, "", "tracked", "renamed to 'tracked_proximity'"},
    {NameKind::stepper, "", "regional", "renamed to 'adaptive_multires'"},
    {NameKind::parameter, "adaptive_multires", "visits", "renamed to 'relaxations'"},
    {NameKind::parameter, "implicit", "factor", "nothing takes its place: steps are solved without a factor"},
    {NameKind::parameter, "", "tip", "give the run's device, --device tip=…"},
    {NameKind::parameter, "", "tip_saturation", "give the run's device, --device saturation=…"},
    {NameKind::parameter, "", "tip_rate", "give the run's device, --device rate=…"},
    {NameKind::parameter, "", "tip_filter", "give the run's device, --device filter=…"},
    {NameKind::parameter, "", "tip_ramp", "give the run's device, --device ramp=…"},
    {NameKind::parameter, "", "velocity_filter", "nothing takes its place: gaps are those at the start of the tick"},
    {NameKind::parameter, "", "max_pairs", "limit the work, work_budget=…"},
    {NameKind::parameter, "ohc", "incremental", "take the detector ohc_clustered"},
    {NameKind::parameter, "unilateral", "settle_time", "renamed to 'relaxation_time'"},
    {NameKind::parameter, "unilateral", "skin", "renamed to 'contact_offset'"},
    {NameKind::parameter, "global_intersection", "settle_time", "renamed to 'relaxation_time'"},
    {NameKind::parameter, "ode_joints", "steps", "nothing takes its place: setting=penalty acts in every sub-step"},
    {NameKind::parameter, "ode_joints", "acts", "nothing takes its place: setting=penalty acts in every sub-step"},
    {NameKind::parameter, "", "acts", "nothing takes its place: impulses act in every sub-step"},
    {NameKind::parameter, "adaptive_multires", "threads", "nothing takes its place: one thread"},
    {NameKind::parameter, "xpbd_contact", "iterations", "the stepper iterates, --stepper xpbd:substeps=…"},
    {NameKind::parameter, "thesis", "projection", of_unilateral},
    {NameKind::parameter, "thesis", "squeeze", of_unilateral},
    {NameKind::parameter, "thesis", "settle_time", of_unilateral},
    {NameKind::parameter, "thesis", "anchor", of_unilateral},
    {NameKind::parameter, "thesis", "samples", of_unilateral},
    {NameKind::parameter, "thesis", "approach", of_unilateral},
    {NameKind::parameter, "thesis", "slip_damping", of_unilateral},
    {NameKind::parameter, "thesis", "tear_time", of_unilateral},
    {NameKind::parameter, "thesis", "d_max", of_unilateral},
    {NameKind::parameter, "thesis", "clear_speed", of_unilateral},
    {NameKind::parameter, "thesis", "rigid", of_unilateral},
    {NameKind::parameter, "thesis", "rigid_settle", of_unilateral},
    {NameKind::parameter, "thesis", "friction", of_unilateral},
    {NameKind::parameter, "thesis", "friction_k", of_unilateral},
    {NameKind::parameter, "thesis", "resolution", "it belongs to the profile; n_back=0 goes back to nothing"},
    {NameKind::parameter, "thesis", "reduction", of_profile},
    {NameKind::parameter, "thesis", "closest_point", of_profile},
    {NameKind::parameter, "thesis", "normal", of_profile},
    {NameKind::parameter, "thesis", "stiffness", of_profile},
    {NameKind::parameter, "thesis", "kappa", of_profile},
    {NameKind::parameter, "thesis", "clamp", of_profile},
    {NameKind::parameter, "thesis", "f_max", of_profile},
    {NameKind::parameter, "thesis", "edges", of_profile},
    {NameKind::parameter, "thesis", "path", of_profile},
    {NameKind::parameter, "thesis", "reaction", of_profile},
    {NameKind::parameter, "thesis", "e", of_profile},
    {NameKind::parameter, "thesis", "rigid_tissue", of_profile},
    {NameKind::parameter, "thesis", "tissue_tissue", of_profile},
    {NameKind::parameter, "thesis", "e_tissue", of_profile},
    {NameKind::parameter, "thesis", "grasp", of_profile},
    {NameKind::parameter, "thesis", "grasp_k", of_profile},
    {NameKind::parameter, "thesis", "grasp_slip", of_profile},
    {NameKind::parameter, "thesis", "jaw_length", of_profile},
    {NameKind::parameter, "thesis", "release_time", of_profile},
    {NameKind::parameter, "thesis", "tip_proxy", of_profile},
    {NameKind::parameter, "thesis", "contacts=hold", "renamed to 'zero_order_hold'"},
    {NameKind::scene_key, "tissue", "stiffening", "springs are linear; leave it out"},
    {NameKind::scene_key, "tissue", "bending", "tissue has no bending stiffness; leave it out"},
    {NameKind::scene_key, "operator", "hand_stiffness", "renamed to 'coupling_stiffness'"},
    {NameKind::scene_key, "operator", "hand_damping", "renamed to 'coupling_damping'"},
    {NameKind::study_key, "", "ablation", R"(write an experiment: "frames": "closed_loop", each setting a response)"},
    {NameKind::study_key, "", "replay", R"(write an experiment: "frames": "replay")"},
    {NameKind::study_key, "", "closed_loop", R"(write an experiment: "frames": "closed_loop")"},
    {NameKind::study_key, "", "triangle_pair", "run trocar_microbench --benchmark_filter=per_pair"},
    {NameKind::study_key, "", "work_precision", R"(write an experiment for each of its sweeps, with the key "sweep")"},
    {NameKind::study_key, "", "paced", R"(write an experiment: "frames": "closed_loop", "clock": "paced")"},
    {NameKind::study_key, "", "cost_by_size", R"(write an experiment: "frames": "closed_loop", "truth_stride": 0)"},
    {NameKind::study_key, "", "hard_cases", R"(write an experiment of each frames: "cases": its folder, "pair_files")"},
    {NameKind::study_key, "", "certificate", R"(write an experiment: "perturbed": true)"},
    {NameKind::study_key, "", "metamorphic", R"(write an experiment: "perturbed": true)"},
});

}  // namespace

std::span<const RetiredName> retired_names() { return retired; }

std::string_view replacement_of(NameKind kind, std::string_view scope, std::string_view name) {
    std::string_view for_all;
    for (const RetiredName& row : retired) {
        if (row.kind != kind || row.name != name) continue;
        if (row.scope == scope) return row.use;
        if (row.scope.empty()) for_all = row.use;
    }
    return for_all;
}

std::string with_replacement(std::string found, NameKind kind, std::string_view scope, std::string_view name) {
    const std::string_view use = replacement_of(kind, scope, name);
    if (!use.empty()) found.append(": ").append(use);
    return found;
}

}  // namespace trocar
