// Converts between the generated protocol types and ours. Beside this library, only the clients' net/
// and the server's rpc, publish, storage and cli see generated types.
#pragma once
#include <optional>

#include "common/core/result.hpp"
#include "common/field/cut.hpp"
#include "common/field/field_hash.hpp"
#include "common/field/restrictions.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "common/surface/view_frustum.hpp"
#include "common/tools/annotation.hpp"
#include "common/tools/c_arm_shot.hpp"
#include "common/tools/placing.hpp"
#include "common/wire/version.hpp"
#include "osteon/v1/cutting.pb.h"
#include "osteon/v1/room.pb.h"
#include "osteon/v1/types.pb.h"
#include "osteon/v1/watch.pb.h"

namespace osteon::wire {

[[nodiscard]] v1::Vector3 to_wire(const Vec3& v);
[[nodiscard]] Vec3 from_wire(const v1::Vector3& v);
[[nodiscard]] v1::Pose to_wire(const Pose& pose);
[[nodiscard]] v1::Coord to_wire(const Coord& c);
[[nodiscard]] Coord from_wire(const v1::Coord& c);
[[nodiscard]] v1::Cut to_wire(const Cut& cut);
[[nodiscard]] v1::CuttingState to_wire(const CuttingState& state);
[[nodiscard]] v1::FieldLeaf to_wire(const FieldLeaf& leaf);  // one value if all are equal
[[nodiscard]] v1::SceneItem to_wire(const SceneItem& item);
[[nodiscard]] v1::ToolDefinition to_wire(const Tool& tool);
[[nodiscard]] v1::ViewFrustum to_wire(const ViewFrustum& look);
[[nodiscard]] v1::Restrictions to_wire(const Restrictions& supervision);
[[nodiscard]] v1::Annotation to_wire(const Annotation& annotation);
[[nodiscard]] v1::ShotRun to_wire(const ShotRun& run);
[[nodiscard]] v1::ShotTotals to_wire(const ShotTotals& totals);
[[nodiscard]] std::string to_wire(const Digest& digest);
[[nodiscard]] v1::RejectionReason to_wire(Rejection reason);

// Error invalid_input, naming the field, for anything that a correct peer never sends: wrong counts, numbers that are
// not finite, quaternions far from unit length, unknown enums, levels out of range.
[[nodiscard]] Result<Pose> from_wire(const v1::Pose& pose);
[[nodiscard]] Result<Cut> from_wire(const v1::Cut& cut);
[[nodiscard]] Result<CuttingState> from_wire(const v1::CuttingState& state);
[[nodiscard]] Result<FieldLeaf> from_wire(const v1::FieldLeaf& leaf);
[[nodiscard]] Result<SceneItem> from_wire(const v1::SceneItem& item);
[[nodiscard]] Result<Placing> placing_from_wire(const v1::SetSceneItemRequest& request);
[[nodiscard]] Result<Tool> from_wire(const v1::ToolDefinition& tool);  // checked by the rules of tool files
[[nodiscard]] Result<BlockKey> key_from_wire(const v1::MeshBlock& block);
[[nodiscard]] Result<ViewFrustum> from_wire(const v1::ViewFrustum& look);
// checked by check(); tools in any order
[[nodiscard]] Result<Restrictions> from_wire(const v1::Restrictions& supervision);
[[nodiscard]] Result<Annotation> from_wire(const v1::Annotation& annotation);  // checked by check()
[[nodiscard]] Result<ShotRun> from_wire(const v1::ShotRun& run);               // checked by check()
[[nodiscard]] Result<ShotTotals> from_wire(const v1::ShotTotals& totals);      // checked by check()
[[nodiscard]] Result<Digest> digest_from_wire(const std::string& bytes);
// Rejection::none for a reason that this version does not know.
[[nodiscard]] Rejection from_wire(v1::RejectionReason reason);

}  // namespace osteon::wire
