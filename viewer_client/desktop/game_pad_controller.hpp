// A game pad in the window: it leads the tool of a BoneView, and its motors show the force.
#pragma once
#include <QCoreApplication>
#include <QElapsedTimer>
#include <functional>

#include "viewer_client/pad/game_pad_mapping.hpp"
#include "viewer_client/pad/game_pad_reader.hpp"

namespace osteon {

class BoneView;

// What the pad's motors show. Zero while no recent state is known.
struct RumbleInput {
  double force_n = 0;  // on the hand
  double most_n = 0;   // the most that the hand's device holds for long
  bool cuts = false;   // the tool removes material
};

// [GUI thread]
class GamePadController {
  Q_DECLARE_TR_FUNCTIONS(GamePadController)

 public:
  struct Events {
    std::function<void(const QString& sentence)> said;  // a pad was plugged in or unplugged
    std::function<void()> undo;
  };

  GamePadController(BoneView& view, Events events);

  // Takes what was read of the pad, moves the tool and sets the motors. Call it once a frame. `may_act`: this window is
  // in front. Otherwise, and while the pad does not answer, it does what rest() does.
  void tick(bool may_act, const RumbleInput& feel);
  // For a pause between ticks: releases all controls and stops the motors.
  void rest();

 private:
  void release_all();

  BoneView& view_;
  Events events_;
  GamePadReader pad_;
  GamePadMapping mapping_;
  QElapsedTimer ticked_;
};

}  // namespace osteon
