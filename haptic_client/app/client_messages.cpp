#include "haptic_client/app/client_messages.hpp"

namespace osteon::haptic {

GuideSeen guide_among(const Partners& partners, AuthorId guide) {
  for (const Partners::Partner& partner : partners.of)
    if (guide && partner.author == guide) return {true, partner.state_seq, partner.pose_bone_device.position_mm};
  return {};
}

}  // namespace osteon::haptic
