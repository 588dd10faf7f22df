// The part of the menu View that says how the bone is drawn: orientation cube, overlays, stereo, and the views that the
// user has saved.
#pragma once
#include <QCoreApplication>
#include <QKeySequence>
#include <QObject>
#include <functional>
#include <vector>

#include "viewer_client/render/stereo.hpp"

class QAction;
class QMenu;

namespace osteon {

class BoneView;

// [GUI thread]
class ViewOptions : public QObject {
  Q_DECLARE_TR_FUNCTIONS(ViewOptions)

 public:
  // Adds an action to a menu: words, name, keys, what it does.
  using Add = std::function<QAction*(QMenu*, const QString&, const char*, const QKeySequence&, std::function<void()>)>;
  using Say = std::function<void(const QString&)>;

  // `view` and the menu must outlive it.
  ViewOptions(BoneView& view, QMenu& menu, const Add& add, Say say, QObject* parent);

  // The menu of overlays: what the picture shows of the case's plan over the bone.
  [[nodiscard]] QMenu* overlays() const { return overlays_; }
  // Saved views are of one bone.
  void show_bone(const QString& title);

 private:
  void add_stereo(QMenu& menu, const Add& add);
  // An action that is on or off, and kept in the settings.
  QAction* add_switch(QMenu& menu, const Add& add, const QString& words, const char* name, const QKeySequence& keys,
                      std::function<void(bool)> change);
  void set_stereo(StereoMode mode);
  void save_view();
  void delete_views();
  void look(int number);
  void refresh();
  [[nodiscard]] QString key() const;

  BoneView& view_;
  Say say_;
  QString title_;
  QMenu* overlays_ = nullptr;
  std::vector<QAction*> stereo_;  // by StereoMode
  std::vector<QAction*> view_actions_;
};

}  // namespace osteon
