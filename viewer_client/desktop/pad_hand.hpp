// A game pad in the window: it leads the tool of a BoneView, and its motors show the force.
#pragma once
#include <QCoreApplication>
#include <QElapsedTimer>
#include <functional>

#include "viewer_client/pad/game_pad.hpp"
#include "viewer_client/pad/pad_control.hpp"

namespace osteon {

class BoneView;

// What the hand gets. Zero where nothing is known of it.
struct PadFeel {
  double force_n = 0;
  double most_n = 0;  // that the device holds
  bool cuts = false;  // material goes
};

// [GUI thread]
class PadHand {
  Q_DECLARE_TR_FUNCTIONS(PadHand)

 public:
  struct Events {
    std::function<void(const QString& sentence)> said;  // a pad came or went
    std::function<void()> undo;
  };

  PadHand(BoneView& view, Events events);

  // To be called at the rate at which the pad is read. Without a pad it only looks for one, once a second.
  // `may_act`: the window is the one in front. Otherwise the pad holds nothing and rests.
  void tick(bool may_act, const PadFeel& feel);
  // Ticks pause until the next one: the pad holds nothing and rests.
  void rest();

 private:
  void let_go();

  BoneView& view_;
  Events events_;
  GamePad pad_;
  PadControl control_;
  QElapsedTimer ticked_, looked_;
};

}  // namespace osteon
