// The order of all locks of the programs. A thread that holds a lock may take only locks that come later in this list.
// deploy/docs/architecture.md says what each of them guards, and who takes it.
#pragma once
#include <cstdint>

// Each rank may be held once: a thread never holds two locks of equal rank.
#define OSTEON_LOCK_RANKS(RANK) \
  RANK(health)                  \
  RANK(rooms_changing)          \
  RANK(case_loading)            \
  RANK(demonstrations)          \
  RANK(upload)                  \
  RANK(access_reading)          \
  RANK(authorizer)              \
  RANK(bone_copy)               \
  RANK(checkpoint)              \
  RANK(link_delivery)           \
  RANK(room)                    \
  RANK(sessions)                \
  RANK(surface)                 \
  RANK(state_streams)           \
  RANK(people_streams)          \
  RANK(stream)                  \
  RANK(journal)                 \
  RANK(handshakes)              \
  RANK(received)                \
  RANK(mount_pose)              \
  RANK(haptic_session)          \
  RANK(leaf) /* of every lock under which no other is taken */

namespace osteon {

enum class LockRank : std::uint8_t {
#define OSTEON_LOCK_RANK(name) name,
  OSTEON_LOCK_RANKS(OSTEON_LOCK_RANK)
#undef OSTEON_LOCK_RANK
};

}  // namespace osteon
