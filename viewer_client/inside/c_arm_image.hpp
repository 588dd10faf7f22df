// Makes the pictures of a C-arm from the bone as it is: radiographs with the metal in the beam, and maximum intensity
// projections by the same geometry.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "common/core/mutex.hpp"
#include "common/radiology/intensifier.hpp"
#include "common/radiology/radiograph.hpp"
#include "viewer_client/imaging/patient_letters.hpp"
#include "viewer_client/inside/c_arm_console.hpp"
#include "viewer_client/inside/inside_bone.hpp"
#include "viewer_client/inside/metal_in_beam.hpp"

namespace osteon {

struct CArmPicture {
  std::uint64_t order = 0;  // 0: a maximum intensity projection, which is no shot
  CArmShot shot;            // without its number, unless it was made again
  bool coarse = false;      // fewer and larger pixels; the whole picture follows, unless something newer does
  int columns = 0, rows = 0;
  std::vector<std::uint8_t> grey;  // row by row
  EdgeLetters letters;             // of the patient's sides
  radiology::Contrast contrast;    // of a radiograph: which photons are black and white
};

class CArmImage final : public InsidePainter {
 public:
  // [A] A coarse picture has a pixel in place of so many by so many.
  static constexpr int kCoarser = 4;
  // [A] Of a maximum intensity projection: black and white, HU.
  static constexpr float kBlack_hu = -200.0f, kWhite_hu = 1800.0f;

  // `shown` gets each picture. [inside thread]
  using Shown = std::function<void(std::shared_ptr<const CArmPicture>)>;  // shared with whoever shows it
  explicit CArmImage(Shown shown, const radiology::Intensifier& intensifier = {});

  // Makes this picture at the next paint(). A newer order takes the place of one that waits. [any thread]
  void make(const ShotOrder& order, std::int64_t time_unix_ms, std::vector<PlacedMetal> metal);
  // The same for a shot that was made before, by this window or another: from where it stood, with its kerma and its
  // noise. `id` takes the place of an order's. With the same bone and metal, and by the same program and libraries, it
  // is the same picture, to the last bit. [any thread]
  void make_again(std::uint64_t id, const CArmShot& shot, std::vector<PlacedMetal> metal);
  // Shows a maximum intensity projection from there, and again after each change of the bone. None: no more.
  // [any thread]
  void show_maximum(const std::optional<CArmPosition>& position);
  // Drops an order that waits. [any thread]
  void drop();

  void paint(const radiology::BoneHu& bone, const InsideChange& change, const KeepGoing& keep_going) override;

 private:
  struct Request {
    std::uint64_t id = 0;
    CArmShot shot;  // kerma 0: its picture sets it
    std::vector<PlacedMetal> metal;
  };
  // The layers of one radiograph, with as many photons as 1 µGy gives.
  struct Layers {
    Layers(const radiology::CArm& arm, const radiology::ConeBeam& beam, radiology::Projection projection)
        : position(arm), image(beam, projection) {}
    radiology::CArm position;
    radiology::Radiograph image;
    std::vector<PlacedMetal> metal;
    std::vector<float> metal_layer, photons_of_ugy;
  };

  void note(const InsideChange& change);
  void shoot(const radiology::BoneHu& bone, const Request& request, const KeepGoing& keep_going);
  void show_projection(const radiology::BoneHu& bone, const CArmPosition& position, const KeepGoing& keep_going);
  // Whether the layers are of this geometry, so that only what changed has to be cast again.
  [[nodiscard]] bool fits(const CArmPosition& position, radiology::Projection projection) const;
  [[nodiscard]] std::optional<Layers> cast(const radiology::BoneHu& bone, const CArmPosition& position, int coarser,
                                           radiology::Projection projection) const;
  // Brings the layers up to date after `changed`, rectangles of the image, and a motion of metal.
  void renew(Layers& layers, const std::vector<PlacedMetal>& metal, std::vector<radiology::PixelBox> changed) const;
  void show_shot(const Layers& layers, CArmShot& shot, std::uint64_t order, bool coarse) const;
  void show_maximum_of(const Layers& layers, bool coarse) const;
  // Something newer waits, so that a whole picture from this position is not worth its time.
  [[nodiscard]] bool outdated(const CArmPosition& position, radiology::Projection projection) const;

  const Shown shown_;
  const radiology::Intensifier intensifier_;

  mutable Mutex mutex_{LockRank::leaf};
  std::optional<Request> waiting_ OSTEON_GUARDED_BY(mutex_);
  std::optional<CArmPosition> maximum_ OSTEON_GUARDED_BY(mutex_);

  // Of the inside thread.
  std::optional<Layers> fine_;
  InsideChange changed_{.all = true};  // since fine_ was cast
};

}  // namespace osteon
