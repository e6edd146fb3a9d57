"""The command `completion`."""

import click
from click import shell_completion


@click.command(epilog="Example: bayesub completion bash >> ~/.bashrc")
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
def completion(context: click.Context, shell: str) -> None:
    """Print what makes a SHELL complete commands, options, files and the names of what is built in.

    For bash and zsh append it to ~/.bashrc or ~/.zshrc, for fish write it to ~/.config/fish/completions/bayesub.fish.
    """
    make = shell_completion.get_completion_class(shell)
    click.echo(make(context.find_root().command, {}, "bayesub", "_BAYESUB_COMPLETE").source())
