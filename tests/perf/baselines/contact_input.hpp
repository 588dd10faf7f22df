// What the contact baseline reads, made from what Osteon's contact reads. Made beforehand; not part of its time.
#pragma once
#include "common/volume/cut_field.hpp"
#include "haptic_client/contact/contact.hpp"
#include "tests/perf/baselines/dense_contact.hpp"

namespace osteon::baselines {

[[nodiscard]] PointArrays point_arrays(const haptic::ContactSet& set);  // groups filled up as in the set
[[nodiscard]] ContactTask contact_task(const haptic::ContactQuery& query);
[[nodiscard]] PointValues room_for(const PointArrays& points);

// f on the samples of a level, and density on those of level 0.
[[nodiscard]] DenseGrid dense_solid(const CutField& field, int level, const CoordBox& box);
[[nodiscard]] DenseGrid dense_density(const Case& bone, const CoordBox& box);

}  // namespace osteon::baselines
