# Carries methods, scenes, studies and scripts from trocar 0.2 to 0.3 (docs/migrating_0.3.md):
#   sed -E -i -f migrating_0.3.sed my_method.cpp CMakeLists.txt my_scene.json my_study.json guard.sh
# Headers
s#"contact/effect.hpp"#"contact/response_output.hpp"#
s#"measure/retelling.hpp"#"measure/permutation.hpp"#
s#"method/source.hpp"#"method/contact_generator.hpp"#
s#"source/#"contact_generation/#
# Types, functions and members
s/\bContactLoad\b/ContactForce/g
s/\bContactSource\b/ContactGenerator/g
s/\bEffect\b/ResponseOutput/g
s/\bLinearContact\b/ContactForceLaw/g
s/\bPlacement\b/PositionCorrection/g
s/\bRetelling\b/Permutation/g
s/\bSourceEntry\b/ContactGeneratorEntry/g
s/\bdefault_source\b/default_contact_generator/g
s/\bmake_source\b/make_contact_generator/g
s/\bhand_damping\b/coupling_damping/g
s/\bhand_stiffness\b/coupling_stiffness/g
s/\bhand_motion\b/operator_motion/g
s/\bis_within_reach\b/is_within_query_distance/g
s/\bcheck_no_reach\b/check_no_query_distance/g
s/\bsquared_reach\b/squared_query_distance/g
s/\bwants_reach\b/wants_query_distance/g
s/\bwithin_reach\b/within_query_distance/g
s/\btakes_linear_contacts\b/takes_contact_force_laws/g
s/\btakes_placements\b/takes_position_corrections/g
s/\bplacements\b/position_corrections/g
s/\bsort_(pairs|near)\(\)/sort()/g
s/\bwhy_untold\b/why_unreported/g
s/\bmissing_touch\b/false_negatives_touch/g
s/\bmissing_swept\b/swept_false_negatives/g
s/\bextra_swept\b/swept_false_positives/g
s/\btrue_near\b/true_proximity_pairs/g
s/\bmax_depth\b/residual_penetration/g
s/\bmean_depth\b/residual_penetration_mean/g
s/\bcontact_loads\b/contact_forces/g
s/\btrocar_add_source\b/trocar_add_contact_generator/g
# Members that are ordinary words elsewhere
s/(\.|->)reach\b/\1query_distance/g
s/(\.|->)sources\b/\1contact_generators/g
s/(\.|->)missing\b/\1false_negatives/g
s/(\.|->)extra\b/\1false_positives/g
s/(\.|->)missed\b/\1proximity_false_negatives/g
s/->loads\(\)/->contact_forces()/g; s/\.loads\(\)/.contact_forces()/g
# Contact generators, the response and the stepper, by name
s/"canonical"/"intersection"/g
s/"near"/"proximity"/g
s/"tracked"/"tracked_proximity"/g
s/"hold"/"unilateral"/g
s/"regional"/"adaptive_multires"/g
s/"hold:/"unilateral:/g
s/(--response|--ours) hold\b/\1 unilateral/g
s/--contacts canonical\b/--contacts intersection/g
s/--contacts near\b/--contacts proximity/g
s/--contacts tracked\b/--contacts tracked_proximity/g
s/--stepper regional\b/--stepper adaptive_multires/g
# Files: formats and keys
s/"trocar-scene-1"/"trocar-scene-2"/g
