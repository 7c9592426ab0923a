"""From recorded jumps to equations, predictions and a verdict, with the recordings that are part of the package."""
import romc

*training, test = romc.recordings("go1")  # three jumps of a simulated Go1
model = romc.train(training, latent_dim=4)
print(model)  # its equations, in m, rad and N
height = model.predict(test, horizon_s=0.1)[:, 14]  # of the body, in m, from the recorded state every 0.1 s
error = height - test.x[:, 14]
print(f"largest error of the body's height over 0.1 s: {1000 * abs(error).max():.1f} mm\n")
print(model.score(test))
